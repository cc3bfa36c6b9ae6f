// Random numbers and the ways to turn them into directions.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/constants.hpp>

namespace solidtex::pathtracer {

// The output function of SplitMix64: a well mixed bijection of 64-bit words.
inline std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

inline float to_unit_float(std::uint64_t bits) { return static_cast<float>(bits >> 40) * 0x1p-24f; }

// Place of i in a random order of [0, n), one order per key. The rounds are bijections of the next
// power of two; walking on until the place is below n makes them one of [0, n).
inline std::uint32_t permute(std::uint32_t i, std::uint32_t n, std::uint64_t key) {
  const std::uint32_t mask = std::bit_ceil(n) - 1;
  const int shift = std::max(1, static_cast<int>(std::bit_width(mask)) / 2);
  do {
    std::uint64_t round_key = key;
    for (int round = 0; round < 3; ++round) {
      i = (i * (static_cast<std::uint32_t>(round_key) | 1) +
           static_cast<std::uint32_t>(round_key >> 32)) &
          mask;
      i ^= i >> shift;
      round_key = mix(round_key);
    }
  } while (i >= n);
  return i;
}

// Stratified samples without state: a number is a function of seed, pixel, sample and dimension, so
// it does not matter which thread asks, or when.
class Sampler {
 public:
  Sampler(std::uint64_t seed, std::uint32_t pixel, std::uint32_t sample, std::uint32_t sample_count)
      : pixel_key_(mix(mix(seed) + pixel)), sample_(sample), sample_count_(sample_count) {}

  float get_1d(std::uint32_t dimension) const {
    const std::uint64_t key = mix(pixel_key_ + dimension);
    return in_stratum(permute(sample_, sample_count_, key), sample_count_, jitter(key));
  }

  glm::vec2 get_2d(std::uint32_t dimension) const {
    const std::uint64_t key = mix(pixel_key_ + dimension);
    const std::uint32_t columns = column_count(sample_count_), rows = sample_count_ / columns;
    const std::uint32_t cell = permute(sample_, sample_count_, key);
    const std::uint64_t random = jitter(key);
    return {in_stratum(cell % columns, columns, random),
            in_stratum(cell / columns, rows, random << 32)};
  }

 private:
  std::uint64_t jitter(std::uint64_t key) const { return mix(key ^ mix(sample_)); }

  static float in_stratum(std::uint32_t stratum, std::uint32_t count, std::uint64_t random) {
    const float x =
        (static_cast<float>(stratum) + to_unit_float(random)) / static_cast<float>(count);
    return std::min(x, 0x1.fffffep-1f);
  }

  // The most nearly square grid of exactly n cells.
  static std::uint32_t column_count(std::uint32_t n) {
    auto columns = static_cast<std::uint32_t>(std::sqrt(static_cast<double>(n)));
    while (n % columns != 0) --columns;
    return columns;
  }

  std::uint64_t pixel_key_;
  std::uint32_t sample_, sample_count_;
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
