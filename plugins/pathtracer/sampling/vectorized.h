// Loops that GCC turns into vector code.
#pragma once

#include <algorithm>
#include <cstddef>

// Before a function: it gets one body for each level of x86-64, of which the machine's is chosen
// when the program starts. The bits are the same, because compiler.cmake forbids contraction and
// nothing is reordered. What such a function calls must be inline, and its file compiled with
// -fno-trapping-math. Sanitizers are not ready when bodies are chosen.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(SOLIDTEX_SANITIZED)
#define SOLIDTEX_VECTORIZED \
  __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define SOLIDTEX_VECTORIZED
#endif

namespace solidtex::pathtracer {

// Of how many items one such call takes care, so that what lies between two calls stays in cache.
inline constexpr int kTogether = 64;

// Up to the end of the last vector: loops without a rest. What is there must be finite.
inline constexpr int whole_vectors(int count) { return (count + 15) & ~15; }

// Calls visit(first, count) for all, as many as possible together.
template <class Visit>
void for_each_some(std::size_t total, const Visit& visit) {
  for (std::size_t first = 0; first < total; first += kTogether) {
    visit(first, static_cast<int>(std::min<std::size_t>(kTogether, total - first)));
  }
}

}  // namespace solidtex::pathtracer
