// Loops that GCC vectorizes.
#pragma once

#include <algorithm>
#include <cstddef>

// Compiles a function once per level of x86-64; the loader picks the machine's. The bits are equal:
// compiler.cmake forbids contraction and nothing is reordered. Callees must be inline, and the file
// must be compiled with -fno-trapping-math. Off under sanitizers, which are not initialized when
// the loader picks.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(SOLIDTEX_SANITIZED)
#define SOLIDTEX_VECTORIZED \
  __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define SOLIDTEX_VECTORIZED
#endif

namespace solidtex::pathtracer {

// Items per vectorized call: intermediate arrays stay in cache.
inline constexpr int kBatchSize = 64;

// Rounds up to whole vectors, which avoids scalar remainder loops. The padding must hold finite
// values.
inline constexpr int padded_count(int count) { return (count + 15) & ~15; }

// Calls visit(first, count) for batches of `total` items.
template <class Visit>
void for_each_batch(std::size_t total, const Visit& visit) {
  for (std::size_t first = 0; first < total; first += kBatchSize) {
    visit(first, static_cast<int>(std::min<std::size_t>(kBatchSize, total - first)));
  }
}

}  // namespace solidtex::pathtracer
