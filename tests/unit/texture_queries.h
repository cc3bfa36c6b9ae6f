// Shared by tests of textures: small models of both families, and queries that return vectors.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "catch.hpp"
#include "engine/common/error.h"
#include "engine/query/texture.h"
#include "tiny_models.h"

namespace texture_queries {

using namespace solidtex::engine;

using Index3 = std::array<std::int64_t, 3>;
using Values = std::vector<float>;

inline constexpr std::uint64_t kSeed = 7;
inline constexpr std::uint64_t kLargeCache = 256u << 20;

inline Values box_of(const Texture& texture, const Index3& origin, const Index3& size) {
  Values values(static_cast<std::size_t>(size[0] * size[1] * size[2]) *
                texture.model().channels.size());
  texture.eval_box(origin.data(), size.data(), values.data());
  return values;
}

inline Values points_of(const Texture& texture, const std::array<double, 3>& origin,
                        const std::vector<float>& points) {
  Values values(points.size() / 3 * texture.model().channels.size());
  texture.eval(origin.data(), points.data(), {}, points.size() / 3, values.data());
  return values;
}

inline std::vector<float> random_points(std::size_t count, float extent, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> coordinate(-extent, extent);
  std::vector<float> points(3 * count);
  for (float& value : points) value = coordinate(random);
  return points;
}

// Compares bits. Returns a bool, so that a failure does not print thousands of floats.
inline bool same(const Values& a, const Values& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

inline std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    CHECK(error.status() == SOLIDTEX_INVALID_ARGUMENT);
    return error.what();
  }
  return "no error";
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

// Both families.
inline std::vector<Model> models() { return {tiny_lattice(), tiny_sampler()}; }

}  // namespace texture_queries
