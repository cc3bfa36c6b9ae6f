// Hashing of 64-bit words.
#pragma once

#include <cstdint>

namespace solidtex {

// The output function of SplitMix64: a well mixed bijection.
inline std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

}  // namespace solidtex
