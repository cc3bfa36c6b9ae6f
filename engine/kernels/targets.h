// Choice of Highway targets. Included before Highway in every file with vector code.
#pragma once

#include <cstdint>

// Register tiles are arrays of vectors, which scalable vectors do not allow. Such machines use NEON
// or the reference loops.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)

// The vector kernels need fused multiply-adds. WebAssembly emulates them; SOLIDTEX_UNFUSED rounds
// twice there instead, which is faster and gives other bits.
#ifdef __wasm_simd128__
#define SOLIDTEX_VECTOR_KERNELS 1
#else
#define SOLIDTEX_VECTOR_KERNELS HWY_NATIVE_FMA
#endif

namespace solidtex::engine::kernels {

// Returns the Highway target of the kernels in this process. Better targets have lower numbers.
std::int64_t active_target();

}  // namespace solidtex::engine::kernels
