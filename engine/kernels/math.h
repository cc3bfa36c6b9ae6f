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

// Returns the sine of an angle; 2^32 is one turn. Exactly 1 at a quarter and -1 at three.
inline float sine_of_turn(std::uint32_t angle) {
  // The outer half of the turn has the sines of the inner half, mirrored.
  const bool inner = angle + 0x40000000u <= 0x80000000u;
  const std::uint32_t folded = inner ? angle : 0x80000000u - angle;
  const float x = static_cast<float>(static_cast<std::int32_t>(folded)) * 0x1p-30f;
  const float square = x * x;
  float p = kQuarterSine[3];
  for (int i = 2; i >= 0; --i) p = std::fma(p, square, kQuarterSine[i]);
  return std::fma(x * std::fma(-x, x, 1.0f), p, x);
}

}  // namespace solidtex::engine
