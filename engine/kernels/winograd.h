// 3^3 convolutions by Winograd's minimal filtering F(2^3, 3^3): 64 products for each tile of 2^3
// voxels instead of 216 (Lavin and Gray, "Fast Algorithms for Convolutional Neural Networks", 2016,
// section 4.1, nested along x, y and z). With F(4, 3) along x, 96 for 4 x 2 x 2 instead of 432.
//
// Tiles begin at absolute multiples of their size, or one voxel further, so that no partition into
// blocks changes a bit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/kernels/linear_layer.h"
#include "engine/kernels/planes.h"

namespace solidtex::engine {

// A dense layer over channels. out[o] = phi(bias[o] + sum over i of weight(i, o) * in[i]), inputs
// in ascending order, each a fused multiply-add; phi(v) = v > 0 ? v : negative_slope * v.
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

  // The weights of positions (ix, iy, 0 .. 3) = (group / 4, group % 4, 0 .. 3) and all outputs.
  const float* at(int group, int input) const {
    return weights.data() + (static_cast<std::ptrdiff_t>(group) * inputs() + input) * outputs * 4;
  }
};

// A 3^3 convolution and the 1^3 convolutions that follow it, evaluated while the tiles are hot.
struct ConvChain {
  // One of the two: Winograd's, or tap by tap. Few inputs are summed sooner than transformed.
  WinogradLayer first;
  LinearLayer taps;
  std::vector<ChannelLayer> rest;
  // Where tiles begin, modulo their size, along every axis: 0 or 1; 1 if an input is upsampled. A
  // 3^3 convolution before another one begins at odd coordinates where that one's begin at even
  // ones: of 17^3 tiles for a block of 32^3, 18^3 would have been needed.
  int origin = 0;

  bool is_direct() const { return taps.outputs > 0; }
  // Voxels along x that are computed together; two along y and z.
  int tile() const { return is_direct() ? 1 : first.tile; }
  int outputs() const;
};

// The (padded) outputs of the chain's widest layer.
int widest_layer(const ConvChain& chain);

// Some input channels of a convolution.
struct ConvSource {
  ConstPlanes planes;
  // The planes, of one parity, are those of a volume of half the size and stand for its nearest
  // upsampling.
  bool upsampled = false;
};

// What to compute: the voxels [lo, hi) of x, and of y and z the tiles [lo, hi). Tile t begins at
// 2 t + origin.
struct TileRange {
  std::int64_t x_lo, x_hi, y_lo, y_hi, z_lo, z_hi;
};

namespace kernels {

// Floats of scratch memory that winograd_conv3d needs.
std::size_t winograd_scratch(const ConvChain& chain);

// Writes planes of `out`; the sources are the inputs in their order. A tile reads its neighbours on
// every side, whether the source has them or not: what lies there may be anything where no result
// depends on it, but must be readable (see PlaneRing). In tiles of four every input along x takes
// part in every output: their tiles must be whole. scratch is aligned to HWY_ALIGNMENT. Fastest
// where all sources have one row pitch.
void winograd_conv3d(const ConvChain& chain, std::span<const ConvSource> sources,
                     const TileRange& range, const Planes& out, float* scratch);

}  // namespace kernels
}  // namespace solidtex::engine
