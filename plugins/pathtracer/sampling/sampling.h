// Random numbers and the ways to turn them into directions.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/constants.hpp>

#include "plugins/pathtracer/sampling/angles.h"
#include "plugins/pathtracer/sampling/sobol.h"

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
  Sampler() = default;
  Sampler(std::uint64_t seed, std::uint32_t pixel, std::uint32_t sample)
      : pixel_key_(mix(mix(seed) + pixel)), sample_(sample) {}

  float get_1d(std::uint32_t dimension) const {
    const std::uint64_t key = mix(pixel_key_ + dimension);
    return to_unit(scrambled_sobol_0(shuffle(sample_, high(key)), low(key)));
  }

  // How a dimension's pairs are shuffled and scrambled: the same for all samples of a pixel.
  struct PairSeeds {
    std::uint32_t order, x, y;
  };
  PairSeeds pair_seeds(std::uint32_t dimension) const {
    const std::uint64_t key = mix(pixel_key_ + dimension);
    return {high(key), low(key), low(mix(key))};
  }
  static glm::vec2 pair(std::uint32_t sample, const PairSeeds& seeds) {
    const std::uint32_t index = shuffle(sample, seeds.order);
    return {to_unit(scrambled_sobol_0(index, seeds.x)), to_unit(scrambled_sobol_1(index, seeds.y))};
  }
  glm::vec2 get_2d(std::uint32_t dimension) const { return pair(sample_, pair_seeds(dimension)); }

  Sampler of_sample(std::uint32_t sample) const {
    Sampler result = *this;
    result.sample_ = sample;
    return result;
  }
  std::uint32_t sample() const { return sample_; }
  bool is_of_pixel_of(const Sampler& other) const { return pixel_key_ == other.pixel_key_; }

 private:
  static std::uint32_t low(std::uint64_t key) { return static_cast<std::uint32_t>(key); }
  static std::uint32_t high(std::uint64_t key) { return static_cast<std::uint32_t>(key >> 32); }
  // Signed, because that is what vectors convert at once.
  static float to_unit(std::uint32_t x) {
    return static_cast<float>(static_cast<std::int32_t>(x >> 8)) * 0x1p-24f;
  }

  std::uint64_t pixel_key_ = 0;
  std::uint32_t sample_ = 0;
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
  return {std::sqrt(u.x) * unit_circle(u.y), std::sqrt(1.0f - u.x)};
}

// Offset in [-1, 1] with the density of a tent.
inline float sample_tent(float u) {
  const float from_edge = 1 - std::sqrt(2 * (u < 0.5f ? u : 1 - u));
  return u < 0.5f ? -from_edge : from_edge;
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
