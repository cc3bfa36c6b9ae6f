// Kernels as plain loops: the definition of correct. kernels.h declares the fast ones.
#pragma once

#include <array>
#include <cstdint>

#include "engine/kernels/linear_layer.h"
#include "engine/kernels/volume.h"
#include "engine/kernels/winograd.h"

namespace solidtex::engine {

// Transposed convolution of stride 2 on absolute coordinates: volumes begin at in_lo and out_lo.
struct TransposedShape {
  int kernel = 2, padding = 0;
  std::array<std::int64_t, 3> in_lo{}, out_lo{};
};

namespace reference {

// Unpadded: out.size = in.size - (kernel - 1), out[i] = layer of in[i + t].
void conv3d(const LinearLayer& layer, int kernel, const ConstVolume& in, const Volume& out);

// The same sum by minimal filtering. Tiles begin at absolute coordinates `origin` modulo their
// size; out begins at out_lo. Upsampled inputs are given with all voxels.
void winograd_conv3d(const WinogradLayer& layer, int origin,
                     const std::array<std::int64_t, 3>& out_lo, const ConstVolume& in,
                     const Volume& out);

// Stride 2: out[o] = layer over the taps t and inputs i with o = 2 i + t - padding.
void conv_transpose3d(const LinearLayer& layer, const TransposedShape& shape, const ConstVolume& in,
                      const Volume& out);

// Points are planar: unit u of point p is in[u * pitch + p].
void dense(const LinearLayer& layer, const float* in, int count, std::ptrdiff_t pitch, float* out);
void dense_point(const PointLayer& layer, const float* in, float* out);

// Multiplies derivatives by the derivative of the activation. Unit u has three runs of `pitch`
// points, for x, y and z. Where units[u * unit_pitch + p], an output of dense, is not positive the
// factor is negative_slope, elsewhere 1.
void activate_derivatives(const LinearLayer& layer, const float* units, std::ptrdiff_t unit_pitch,
                          std::ptrdiff_t pitch, float* derivatives);

// Element-wise. Both volumes have the same size and channels.
void affine(const float* scale, const float* shift, const ConstVolume& in, const Volume& out);
void leaky_relu(float negative_slope, const ConstVolume& in, const Volume& out);
void tanh(const ConstVolume& in, const Volume& out);
void sigmoid(const ConstVolume& in, const Volume& out);

// exp(in - m) divided by its sum over the channels in their order, where m is the largest channel.
void softmax(const ConstVolume& in, const Volume& out);

}  // namespace reference
}  // namespace solidtex::engine
