// Warps of uniform random numbers, shading frames, multiple importance sampling.
#pragma once

#include <cmath>
#include <glm/glm.hpp>

#include "plugins/pathtracer/sampling/angles.h"

namespace solidtex::pathtracer {

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

// Direction around +z with density cos(theta) / pi.
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

}  // namespace solidtex::pathtracer
