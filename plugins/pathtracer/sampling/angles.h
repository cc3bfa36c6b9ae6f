// Trigonometry in turns by branch-free polynomials, which vectorize and are several times as fast
// as libm. tests/battery/fit_polynomials.py prints the coefficients. Stated errors exclude
// rounding.
#pragma once

#include <cmath>
#include <glm/glm.hpp>

namespace solidtex::pathtracer {

// Horner's rule. Coefficients start with the lowest power.
template <int kCount>
inline float polynomial(const float (&coefficients)[kCount], float x) {
  float sum = coefficients[kCount - 1];
  for (int i = kCount - 2; i >= 0; --i) sum = sum * x + coefficients[i];
  return sum;
}

// atan(r) / (2 pi r) in r^2, |r| <= tan(pi / 8), absolute 3.5e-09 radians
inline constexpr float kArcTangent[] = {0.15915492177009583f, -0.05304984748363495f,
                                        0.03177042305469513f, -0.021891184151172638f,
                                        0.012309107929468155f};

// sin(2 pi r) / r in r^2, |r| <= 1/8, absolute 1.2e-09
inline constexpr float kSine[] = {6.283185005187988f, -41.34162902832031f, 81.58812713623047f,
                                  -75.24006652832031f};

// cos(2 pi r) in r^2, |r| <= 1/8, absolute 4.7e-11
inline constexpr float kCosine[] = {1.0f, -19.739208221435547f, 64.93931579589844f,
                                    -85.44285583496094f, 59.2204704284668f};

// Returns (cosine, sine). The angle must be below 2^20 turns.
inline glm::vec2 unit_circle(float turns) {
  const int quarters = static_cast<int>(4 * turns + std::copysign(0.5f, turns));
  const float rest = turns - 0.25f * static_cast<float>(quarters);
  const float square = rest * rest;
  const float sine = rest * polynomial(kSine, square), cosine = polynomial(kCosine, square);
  const bool odd = quarters & 1;
  const float x = odd ? sine : cosine, y = odd ? cosine : sine;
  return {(quarters + 1) & 2 ? -x : x, quarters & 2 ? -y : y};
}

// Returns the angle of (x, y) from -1/2 to 1/2; 0 for (0, 0).
inline float turns_of(float x, float y) {
  constexpr float kEighth = 0.41421356f;  // tan(pi / 8)
  const float a = std::abs(x), b = std::abs(y);
  const float large = a > b ? a : b, small = a > b ? b : a;
  const bool beyond = small > kEighth * large;  // closer to the diagonal than to the axis
  const float top = beyond ? small - large : small, bottom = beyond ? small + large : large;
  const float ratio = top / (bottom > 0 ? bottom : 1);
  const float near = ratio * polynomial(kArcTangent, ratio * ratio);
  const float octant = beyond ? 0.125f + near : near;
  const float quadrant = b > a ? 0.25f - octant : octant;
  return std::copysign(x < 0 ? 0.5f - quadrant : quadrant, y);
}

}  // namespace solidtex::pathtracer
