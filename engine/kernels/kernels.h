// The kernels that evaluation uses: Highway bodies, dispatched per call to the machine's best
// target. Bit for bit the loops of reference.h, which also serve targets without fused
// multiply-add.
#pragma once

#include "engine/kernels/reference.h"

namespace solidtex::engine::kernels {

// Inputs must be readable kReadSlack floats past their end.
void conv3d(const LinearLayer& layer, int kernel, const ConstVolume& in, const Volume& out);
void dense(const LinearLayer& layer, const float* in, int count, std::ptrdiff_t pitch, float* out);

using reference::affine;
using reference::conv_transpose3d;
using reference::leaky_relu;
using reference::sigmoid;
using reference::tanh;

}  // namespace solidtex::engine::kernels
