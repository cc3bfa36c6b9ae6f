// Directions, integrals over them, and random numbers.
#pragma once

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/constants.hpp>

#include "plugins/common/hash.h"

namespace scene_tests {

// Negative cosines are below the surface.
inline glm::vec3 direction(float cosine, float angle) {
  const float sine = std::sqrt(1 - cosine * cosine);
  return {sine * std::cos(angle), sine * std::sin(angle), cosine};
}

// Integral of f(direction) over cosines from `low` to `high`, by a midpoint rule that is finest at
// both ends, where narrow lobes are.
template <class F>
auto integrate(F f, float low = 0, float high = 1) {
  constexpr int kRows = 700, kColumns = 700;
  decltype(f(glm::vec3())) sum{};
  for (int i = 0; i < kRows; ++i) {
    const float t = (static_cast<float>(i) + 0.5f) / kRows;
    const float cosine = low + (high - low) * t * t * (3 - 2 * t);
    decltype(f(glm::vec3())) row{};
    for (int j = 0; j < kColumns; ++j) {
      row += f(direction(cosine, glm::two_pi<float>() * (static_cast<float>(j) + 0.5f) / kColumns));
    }
    sum += row * double(6 * t * (1 - t));
  }
  return sum * double((high - low) * glm::two_pi<float>() / (kRows * kColumns));
}

// Independent random numbers in [0, 1).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  float next() { return static_cast<float>(solidtex::mix(state_++) >> 40) * 0x1p-24f; }

 private:
  std::uint64_t state_;
};

}  // namespace scene_tests
