// Random numbers and the ways to turn them into directions.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/constants.hpp>

#include "plugins/pathtracer/sobol.h"

namespace solidtex::pathtracer {

// The output function of SplitMix64: a well mixed bijection of 64-bit words.
inline std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

inline float to_unit_float(std::uint64_t bits) { return static_cast<float>(bits >> 40) * 0x1p-24f; }

// Well distributed samples without state: a number is a function of seed, pixel, sample and
// dimension, so it does not matter which thread asks, or when. Each dimension (or pair of them) has
// a Sobol' sequence of its own, shuffled and scrambled, so that all are independent.
class Sampler {
 public:
  Sampler(std::uint64_t seed, std::uint32_t pixel, std::uint32_t sample)
      : pixel_key_(mix(mix(seed) + pixel)), sample_(sample) {}

  float get_1d(std::uint32_t dimension) const {
    const std::uint64_t key = mix(pixel_key_ + dimension);
    return to_unit(scrambled_sobol_0(shuffle(sample_, high(key)), low(key)));
  }

  glm::vec2 get_2d(std::uint32_t dimension) const {
    const std::uint64_t key = mix(pixel_key_ + dimension);
    const std::uint32_t index = shuffle(sample_, high(key));
    return {to_unit(scrambled_sobol_0(index, low(key))),
            to_unit(scrambled_sobol_1(index, low(mix(key))))};
  }

 private:
  static std::uint32_t low(std::uint64_t key) { return static_cast<std::uint32_t>(key); }
  static std::uint32_t high(std::uint64_t key) { return static_cast<std::uint32_t>(key >> 32); }
  static float to_unit(std::uint32_t x) { return static_cast<float>(x >> 8) * 0x1p-24f; }

  std::uint64_t pixel_key_;
  std::uint32_t sample_;
};

// Right-handed orthonormal frame around a unit normal (z), after Duff et al., "Building an
// Orthonormal Basis, Revisited", 2017.
struct Frame {
  explicit Frame(const glm::vec3& n) : z(n) {
    const float sign = std::copysign(1.0f, n.z);
    const float a = -1.0f / (sign + n.z), b = n.x * n.y * a;
    x = {1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x};
    y = {b, sign + n.y * n.y * a, -n.y};
  }
  glm::vec3 to_local(const glm::vec3& v) const {
    return {glm::dot(v, x), glm::dot(v, y), glm::dot(v, z)};
  }
  glm::vec3 to_world(const glm::vec3& v) const { return x * v.x + y * v.y + z * v.z; }

  glm::vec3 x, y, z;
};

// Direction with density cos(theta) / pi about +z.
inline glm::vec3 sample_cosine_hemisphere(const glm::vec2& u) {
  const float radius = std::sqrt(u.x), angle = glm::two_pi<float>() * u.y;
  return {radius * std::cos(angle), radius * std::sin(angle), std::sqrt(1.0f - u.x)};
}

// Offset in [-1, 1] with the density of a tent.
inline float sample_tent(float u) {
  return u < 0.5f ? std::sqrt(2 * u) - 1 : 1 - std::sqrt(2 - 2 * u);
}

// Veach's power heuristic with exponent 2, for a sample drawn with density `pdf`.
inline float power_heuristic(float pdf, float other_pdf) {
  const float a = pdf * pdf, b = other_pdf * other_pdf;
  return a > 0 ? a / (a + b) : 0;
}

inline float luminance(const glm::vec3& color) {
  return glm::dot(color, glm::vec3(0.2126f, 0.7152f, 0.0722f));
}

}  // namespace solidtex::pathtracer
