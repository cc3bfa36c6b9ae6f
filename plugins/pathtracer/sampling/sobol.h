// The first two dimensions of Sobol's sequence with hash-based Owen scrambling (Burley, "Practical
// Hash-based Owen Scrambling", 2020; hash of Laine and Karras as improved by Vegdahl). 2^k points
// that start at a multiple of 2^k are stratified over all elementary intervals of area 2^-k.
#pragma once

#include <cstdint>

namespace solidtex::pathtracer {

inline std::uint32_t reverse_bits(std::uint32_t x) {
  x = (x >> 16) | (x << 16);
  x = ((x & 0xff00ff00u) >> 8) | ((x & 0x00ff00ffu) << 8);
  x = ((x & 0xf0f0f0f0u) >> 4) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x & 0xccccccccu) >> 2) | ((x & 0x33333333u) << 2);
  return ((x & 0xaaaaaaaau) >> 1) | ((x & 0x55555555u) << 1);
}

// Owen scrambling of bit-reversed numbers: flips each bit by a function of the seed and the lower
// bits.
inline std::uint32_t scramble_reversed(std::uint32_t x, std::uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1;
  x ^= x * 0x05526c56u;
  return x ^ (x * 0x53a22864u);
}

// Permutes indices of the sequence. Aligned blocks of 2^k stay together.
inline std::uint32_t shuffle(std::uint32_t index, std::uint32_t seed) {
  return reverse_bits(scramble_reversed(reverse_bits(index), seed));
}

// The second dimension, bit-reversed; the first, bit-reversed, is the index itself. The generator
// matrix is Pascal's triangle modulo 2. Bit k is the sum over all bits j of the index that contain
// k (Lucas), computed in five steps.
inline std::uint32_t reversed_sobol_1(std::uint32_t index) {
  index ^= (index & 0xaaaaaaaau) >> 1;
  index ^= (index & 0xccccccccu) >> 2;
  index ^= (index & 0xf0f0f0f0u) >> 4;
  index ^= (index & 0xff00ff00u) >> 8;
  return index ^ ((index & 0xffff0000u) >> 16);
}

// In units of 2^-32.
inline std::uint32_t scrambled_sobol_0(std::uint32_t index, std::uint32_t seed) {
  return reverse_bits(scramble_reversed(index, seed));
}
inline std::uint32_t scrambled_sobol_1(std::uint32_t index, std::uint32_t seed) {
  return reverse_bits(scramble_reversed(reversed_sobol_1(index), seed));
}

}  // namespace solidtex::pathtracer
