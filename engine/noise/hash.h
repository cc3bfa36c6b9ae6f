// Integer part of the noise schemes. See docs/noise.md. All arithmetic wraps.
#pragma once

#include <cstdint>

namespace solidtex::engine {

inline constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15u;

// Finalizer of SplitMix64.
inline std::uint64_t mix64(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

// Key of a stream, from seed, level and channel. A lattice point is combined with it by xor.
struct StreamKey {
  std::uint32_t word[4];
};

inline StreamKey make_stream_key(std::uint64_t seed, std::uint32_t level, std::uint32_t channel) {
  const std::uint64_t place = (std::uint64_t{level} << 32) | channel;
  const std::uint64_t h = mix64(mix64(seed + kGolden) + place + kGolden);
  const std::uint64_t k01 = mix64(h + 1 * kGolden), k23 = mix64(h + 2 * kGolden);
  return {{static_cast<std::uint32_t>(k01), static_cast<std::uint32_t>(k01 >> 32),
           static_cast<std::uint32_t>(k23), static_cast<std::uint32_t>(k23 >> 32)}};
}

// Scheme solidtex-1: returns 32 random bits for a lattice point.
inline std::uint32_t solidtex_1_bits(const StreamKey& key, std::uint32_t x, std::uint32_t y,
                                     std::uint32_t z) {
  std::uint32_t a = x ^ key.word[0], b = y ^ key.word[1], c = z ^ key.word[2], d = key.word[3];
  const auto step = [](std::uint32_t word) { return word * 1664525u + 1013904223u; };
  const auto fold = [](std::uint32_t word) { return word ^ (word >> 16); };
  const auto cross = [&] {
    a += b * d;
    b += c * a;
    c += a * b;
    d += b * c;
  };
  a = step(a), b = step(b), c = step(c), d = step(d);
  cross();
  a = fold(a), b = fold(b), c = fold(c), d = fold(d);
  cross();
  const std::uint32_t t = a ^ (a << 11);
  return d ^ (d >> 19) ^ t ^ (t >> 8);
}

// Scheme solidtexturenets: returns 64 bits, from Wang's hash of the key and one xorshift64* step.
inline std::uint64_t solidtexturenets_bits(std::uint64_t seed, std::uint32_t level,
                                           std::uint32_t channel, std::uint32_t x, std::uint32_t y,
                                           std::uint32_t z) {
  constexpr std::uint64_t p = 65536;
  std::uint64_t k = std::uint64_t{level % 5} * 15 * p * p + std::uint64_t{channel % 3} * 3 * p * p +
                    (z % p) * p * p + (y % p) * p + x % p;
  if (k == 0) k = 1;
  if (seed != 0) k ^= mix64(seed);
  k = ~k + (k << 21);
  k ^= k >> 24;
  k = (k + (k << 3)) + (k << 8);
  k ^= k >> 14;
  k = (k + (k << 2)) + (k << 4);
  k ^= k >> 28;
  k += k << 31;
  k ^= k >> 12;
  k ^= k << 25;
  k ^= k >> 27;
  return k * 0x2545F4914F6CDD1Du;
}

}  // namespace solidtex::engine
