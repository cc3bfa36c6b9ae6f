// Included before Highway in every file with vector code: which targets get a body of their own.
#pragma once

#include <cstdint>

// Register tiles are arrays of vectors, which scalable vectors do not allow: there, NEON or the
// reference loops serve.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)

namespace solidtex::engine::kernels {

// The Highway target that the kernels of this process run on. Better targets have lower numbers.
std::int64_t active_target();

}  // namespace solidtex::engine::kernels
