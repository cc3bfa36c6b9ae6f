// The kernels that evaluation uses: Highway bodies, dispatched per call to the machine's best
// target. Bit for bit the loops of reference.h, which also serve targets without fused
// multiply-add.
#pragma once

#include "engine/kernels/reference.h"

namespace solidtex::engine::kernels {

// Inputs must be readable kReadSlack floats past their end.
void conv3d(const LinearLayer& layer, int kernel, const ConstVolume& in, const Volume& out);
void conv_transpose3d(const LinearLayer& layer, const TransposedShape& shape, const ConstVolume& in,
                      const Volume& out);

// Inputs are read and outputs written to a multiple of kPointStep points and LinearLayer::kPack
// outputs: what lies behind `count` and `outputs` is no result.
inline constexpr int kPointStep = 16;
void dense(const LinearLayer& layer, const float* in, int count, std::ptrdiff_t pitch, float* out);
// One point, the same bits; writes layer.pitch values.
void dense_point(const PointLayer& layer, const float* in, float* out);
// In place; the pitches are multiples of kPointStep.
void activate_derivatives(const LinearLayer& layer, const float* units, std::ptrdiff_t unit_pitch,
                          std::ptrdiff_t pitch, float* derivatives);

void affine(const float* scale, const float* shift, const ConstVolume& in, const Volume& out);
void leaky_relu(float negative_slope, const ConstVolume& in, const Volume& out);
void tanh(const ConstVolume& in, const Volume& out);
void sigmoid(const ConstVolume& in, const Volume& out);

}  // namespace solidtex::engine::kernels
