// Rays, hits and surface interactions.
#pragma once

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>

namespace solidtex::pathtracer {

// A ray with its cone: the radius at a distance from the origin (Amanatides, "Ray tracing with
// cones", 1984). A cone that starts on a lens narrows until the focus and widens again.
struct Ray {
  glm::vec3 origin{0}, direction{0, 0, 1};  // direction has unit length
  float radius = 0, spread = 0;
  float inverse_focus = 0;  // 1 / distance of the focus

  float radius_at(float distance) const {
    return radius * std::abs(1 - distance * inverse_focus) + spread * distance;
  }
};

// An occlusion query between two points.
struct ShadowRay {
  glm::vec3 origin{0}, direction{0, 0, 1};  // direction has unit length
  float distance = std::numeric_limits<float>::infinity();
};

struct Hit {
  enum class Kind { nothing, object, light };
  Kind kind = Kind::nothing;
  std::uint32_t index = 0;     // of the object or light
  std::uint32_t triangle = 0;  // of the mesh of the object or light
  glm::vec2 barycentric{0};
  float distance = std::numeric_limits<float>::infinity();
};

// Input of shading at a point of an object. Normals have unit length and face the ray.
struct SurfaceInteraction {
  glm::vec3 position{0};         // in render space
  glm::vec3 object_position{0};  // relative to the mesh's origin
  glm::vec3 geometric_normal{0}, normal{0};
  glm::vec2 uv{0};
  float attribute = 0;  // of the mesh, interpolated
  std::uint32_t object = 0, material = 0;
  bool inside = false;     // the ray came from the back of the geometric normal
  glm::vec3 view{0};       // ray direction, unit length
  float footprint = 0;     // radius of the ray's cone on the surface, in world units
  float object_scale = 1;  // object units per world unit
  glm::vec3 jitter{0};     // point in the footprint's cube [-1, 1]^3, for stochastic filtering
};

// At grazing angles footprints grow as if the cosine were this.
inline constexpr float kMinCosine = 0.01f;

}  // namespace solidtex::pathtracer
