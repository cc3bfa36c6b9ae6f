// Scalar definition of random numbers from 32 bits: uniform in [0, 1) and standard normal.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "engine/kernels/polynomials.h"

namespace solidtex::engine {

inline constexpr std::int32_t kSqrtHalfBits = 0x3F3504F3;  // sqrt(1/2) as a float's bits
inline constexpr float kMinus2Log2 = -1.3862943611198906f;

inline float uniform_from_bits(std::uint32_t bits) {
  return static_cast<float>(bits >> 8) * 0x1p-24f;
}

// The 31 low bits select p in (0, 1/2), the top bit the sign. With t = sqrt(-2 log p) the normal
// quantile is a smooth function of t, zero at t = sqrt(2 log 2).
inline float normal_from_bits(std::uint32_t bits) {
  const float p =
      (static_cast<float>(static_cast<std::int32_t>(bits & 0x7FFFFFFFu)) + 0.5f) * 0x1p-32f;
  // p = 2^exponent * (1 + f) with 1 + f in [sqrt(1/2), sqrt(2)).
  const std::int32_t p_bits = std::bit_cast<std::int32_t>(p);
  const std::int32_t exponent = (p_bits - kSqrtHalfBits) >> 23;
  const float f = std::bit_cast<float>(p_bits - (exponent << 23)) - 1.0f;
  float minus_2_log = kMinus2Log1p[9];
  for (int i = 8; i >= 0; --i) minus_2_log = std::fma(minus_2_log, f, kMinus2Log1p[i]);
  minus_2_log = std::fma(static_cast<float>(exponent), kMinus2Log2, minus_2_log * f);

  const float s = std::sqrt(minus_2_log) - kQuantileStart;
  float top = kQuantileTop[3], bottom = kQuantileBottom[2];
  for (int i = 2; i >= 0; --i) top = std::fma(top, s, kQuantileTop[i]);
  for (int i = 1; i >= 0; --i) bottom = std::fma(bottom, s, kQuantileBottom[i]);
  const float magnitude = s * top / std::fma(bottom, s, 1.0f);
  return (bits >> 31) != 0 ? magnitude : -magnitude;
}

}  // namespace solidtex::engine
