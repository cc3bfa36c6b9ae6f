// Scalar definition of the activations by polynomials with the same bits everywhere.
// docs/numerics.md states their errors.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "engine/kernels/polynomials.h"

namespace solidtex::engine {

inline constexpr float kLog2E = 1.44269504088896341f;
// log(2) in two parts. The first has few bits: its products with small integers are exact.
inline constexpr float kLog2High = 0.693359375f, kLog2Low = -2.12194440e-4f;
inline constexpr float kRoundingShift = 0x1.8p23f;  // adding it rounds to an integer
inline constexpr float kExpLimit = 87.0f;           // exp(-87) is the smallest result
inline constexpr float kTanhSwitch = 0.625f;        // below it: the odd polynomial

// Returns exp(-v) for v >= 0.
inline float exp_negative(float v) {
  const float x = v < kExpLimit ? -v : -kExpLimit;
  const float shifted = std::fma(x, kLog2E, kRoundingShift);
  const float n = shifted - kRoundingShift;
  const float r = std::fma(n, -kLog2Low, std::fma(n, -kLog2High, x));
  float p = kExp[4];
  for (int i = 3; i >= 0; --i) p = std::fma(p, r, kExp[i]);
  const float e = 1.0f + std::fma(p, r * r, r);
  const std::int32_t power = (static_cast<std::int32_t>(n) + 127) << 23;
  return e * std::bit_cast<float>(power);
}

inline float sigmoid(float x) {
  const float e = exp_negative(std::fabs(x));
  return (x > 0 ? 1.0f : e) / (1.0f + e);
}

inline float tanh(float x) {
  const float v = std::fabs(x);
  const float e = exp_negative(v + v);
  const float far = (1.0f - e) / (1.0f + e);
  const float square = v * v;
  float p = kTanh[4];
  for (int i = 3; i >= 0; --i) p = std::fma(p, square, kTanh[i]);
  const float near = std::fma(p * square, v, v);
  return std::copysign(v < kTanhSwitch ? near : far, x);
}

}  // namespace solidtex::engine
