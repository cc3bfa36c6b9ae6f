// 3^3 convolutions by Winograd's minimal filtering F(2^3, 3^3): 64 products per tile of 2^3 voxels
// in place of 216 (Lavin and Gray, "Fast Algorithms for Convolutional Neural Networks", 2016,
// section 4.1, nested along x, y and z). F(4, 3) along x needs 96 for 4 x 2 x 2 in place of 432.
//
// Tiles begin at absolute multiples of their size, or one voxel later, so that no partition into
// blocks changes a bit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/kernels/linear_layer.h"
#include "engine/kernels/planes.h"

namespace solidtex::engine {

// Dense layer over channels. out[o] = phi(bias[o] + sum over i of weight(i, o) * in[i]): inputs in
// ascending order, each a fused multiply-add. phi(v) = v > 0 ? v : negative_slope * v.
struct ChannelLayer {
  static constexpr int kPack = 4;  // outputs are padded to a multiple of it

  int inputs = 0, outputs = 0, padded = 0;
  std::vector<float> weights;  // [input][padded]
  std::vector<float> bias;     // [padded]
  float negative_slope = 1;

  ChannelLayer() = default;
  // weights: [output][input].
  ChannelLayer(int inputs, int outputs, const std::vector<float>& weights, std::vector<float> bias);
};

// The weights of a 3^3 convolution, transformed in double and rounded once. Tiles are of `tile`
// voxels along x, 2 or 4, and of 2 along y and z.
//
// An upsampled input holds every value twice. In tiles that begin at odd coordinates their inputs
// are a, a, b, b, and F(2, 3) is
//   y0 = (g0 + g1 - g2) / 2 (a - b) + (g0 + g1 + g2) / 2 (a + b)
//   y1 = (g0 + g1 + g2) / 2 (a + b) - (g1 + g2 - g0) / 2 (a - b)
// three products along each axis instead of four, at the positions 0, 1 and 3 of the others.
struct WinogradLayer {
  int tile = 2, outputs = 0;
  std::vector<bool> upsampled;  // [input]
  std::vector<float> weights;   // [ix][iy][input][output][iz]
  std::vector<float> bias;      // [output]
  float negative_slope = 1;

  WinogradLayer() = default;
  // weights: [output][input][3][3][3].
  WinogradLayer(int tile, std::vector<bool> upsampled, int outputs,
                const std::vector<float>& weights, std::vector<float> bias);

  int inputs() const { return static_cast<int>(upsampled.size()); }

  // Returns the weights of positions (ix, iy, 0 .. 3) for all outputs; group = 4 ix + iy.
  const float* at(int group, int input) const {
    return weights.data() + (static_cast<std::ptrdiff_t>(group) * inputs() + input) * outputs * 4;
  }
};

// A 3^3 convolution and the 1^3 convolutions that follow it, evaluated while tiles are in cache.
struct ConvChain {
  // One of the two is used: Winograd's method, or taps for few inputs.
  WinogradLayer first;
  LinearLayer taps;
  std::vector<ChannelLayer> rest;
  // First coordinate of tiles modulo 2, on every axis. It is 1 if an input is upsampled. A
  // convolution before another one has the opposite origin: fewer tiles cover its region.
  int origin = 0;

  bool is_direct() const { return taps.outputs > 0; }
  // Voxels along x that are computed together. Along y and z these are 2.
  int tile() const { return is_direct() ? 1 : first.tile; }
  int outputs() const;
};

// Returns the padded outputs of the widest layer.
int widest_layer(const ConvChain& chain);

// Some input channels of a convolution.
struct ConvSource {
  ConstPlanes planes;
  // Whether the planes, without a parity split, have half the size and stand for their nearest
  // upsampling.
  bool upsampled = false;
};

// The voxels [lo, hi) of x and the tiles [lo, hi) of y and z to compute. Tile t begins at 2 t +
// origin.
struct TileRange {
  std::int64_t x_lo, x_hi, y_lo, y_hi, z_lo, z_hi;
};

namespace kernels {

// Returns the floats of scratch memory that winograd_conv3d needs.
std::size_t winograd_scratch(const ConvChain& chain);

// Writes planes of `out`. Sources are the inputs in order. A tile reads its neighbors on every
// side: these must be readable (see PlaneRing), and their values matter only where a result depends
// on them. In tiles of four every input along x affects every output: such tiles must be whole.
// scratch is aligned to HWY_ALIGNMENT. Sources with equal row pitches are the fastest.
void winograd_conv3d(const ConvChain& chain, std::span<const ConvSource> sources,
                     const TileRange& range, const Planes& out, float* scratch);

}  // namespace kernels
}  // namespace solidtex::engine
