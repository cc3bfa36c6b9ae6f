// Highway kernels, dispatched per call to the active target. They have the bits of reference.h,
// which also serves targets without fused multiply-add.
#pragma once

#include "engine/kernels/reference.h"

namespace solidtex::engine::kernels {

// Inputs are readable kReadSlack floats beyond their end.
void conv3d(const LinearLayer& layer, int kernel, const ConstVolume& in, const Volume& out);
void conv_transpose3d(const LinearLayer& layer, const TransposedShape& shape, const ConstVolume& in,
                      const Volume& out);

// Inputs are read and outputs written up to multiples of kPointStep points and LinearLayer::kPack
// outputs; values beyond `count` and `outputs` are undefined.
inline constexpr int kPointStep = 16;
void dense(const LinearLayer& layer, const float* in, int count, std::ptrdiff_t pitch, float* out);
// Evaluates one point with the bits of dense. Writes layer.pitch values.
void dense_point(const PointLayer& layer, const float* in, float* out);
// Works in place. The pitches are multiples of kPointStep.
void activate_derivatives(const LinearLayer& layer, const float* units, std::ptrdiff_t unit_pitch,
                          std::ptrdiff_t pitch, float* derivatives);

void affine(const float* scale, const float* shift, const ConstVolume& in, const Volume& out);
void leaky_relu(float negative_slope, const ConstVolume& in, const Volume& out);
void tanh(const ConstVolume& in, const Volume& out);
void sigmoid(const ConstVolume& in, const Volume& out);
void softmax(const ConstVolume& in, const Volume& out);

}  // namespace solidtex::engine::kernels
