// Ray queries on a scene. A mesh that several objects share is an Embree scene of its own,
// instanced once per object.
#pragma once

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

#include "plugins/pathtracer/geometry/embree.h"
#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

// With the cone that it stands for, as radius at a distance from the origin (Amanatides 1984, "Ray
// tracing with cones"). What starts on a lens narrows until its focus and widens again.
struct Ray {
  glm::vec3 origin{0}, direction{0, 0, 1};  // direction has unit length
  float radius = 0, spread = 0;
  float inverse_focus = 0;  // 1 / distance at which the lens is sharp

  float radius_at(float distance) const {
    return radius * std::abs(1 - distance * inverse_focus) + spread * distance;
  }
};

// Asks whether there is anything between a point and another.
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

// What shading needs to know of a point on an object. Normals are of unit length and on the side
// that the ray came from.
struct Surface {
  glm::vec3 position{0}, object_position{0};
  glm::vec3 geometric_normal{0}, normal{0};
  glm::vec2 uv{0};
  std::uint32_t object = 0, material = 0;
  bool inside = false;     // the ray came from where the geometric normal does not point
  glm::vec3 view{0};       // direction of the ray, of unit length
  float footprint = 0;     // radius that the ray's cone sees of it, in the scene's units
  float object_scale = 1;  // units of the object's space in one of the scene's
  glm::vec3 jitter{0};     // place in the footprint, for stochastic filtering
};

// Footprints grow no further where a ray meets a surface at a flatter angle.
inline constexpr float kLeastCosine = 0.01f;

class EmbreeScene {
 public:
  // Keeps a reference to `scene`.
  explicit EmbreeScene(const Scene& scene);

  Hit intersect(const Ray& ray) const;
  bool occluded(const ShadowRay& ray) const;

  // The same for many rays, in packets of neighbours: the more alike they are, the faster. Embree
  // finds the same bits for a ray in any company (tests/scenes/test_packets.cpp). `coherent`: as
  // the rays of a pixel are. Of a million triangles, on a processor with AVX-512, intersection took
  // 0.57 of the time that ray by ray it does (coherent rays alone: 0.8 without saying so).
  void intersect(std::span<const Ray> rays, bool coherent, std::span<Hit> hits) const;
  void occluded(std::span<const ShadowRay> rays, std::span<std::uint8_t> results) const;

  Surface surface(const Ray& ray, const Hit& hit) const;

  // A point just above the surface, on the side of `direction`, from which rays can start.
  glm::vec3 leave(const Surface& surface, const glm::vec3& direction) const;

 private:
  struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };
  template <class Handle>
  using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Release>;

  template <int kWidth>
  void intersect_packets(std::span<const Ray> rays, bool coherent, std::span<Hit> hits) const;
  template <int kWidth>
  void occluded_packets(std::span<const ShadowRay> rays, std::span<std::uint8_t> results) const;
  Hit to_hit(unsigned instance, unsigned geometry) const;
  Owned<RTCScene> build_mesh(const Mesh& mesh) const;
  void attach_object(const Object& object, unsigned id);
  void attach_instance(const Object& object, unsigned id);
  void attach_alone(const Object& object, unsigned id);
  void attach_light(const RectangleLight& light, unsigned id);
  void attach_light(const SphereLight& light, unsigned id);
  void attach_light(const MeshLight& light, unsigned id);

  const Scene& scene_;
  Owned<RTCDevice> device_;
  int packet_width_;                     // what the machine's vectors hold; 1: ray by ray
  std::vector<Owned<RTCScene>> meshes_;  // null for those of one object
  Owned<RTCScene> root_;
  std::vector<glm::mat3> normal_matrices_;  // per object
  std::vector<float> object_scales_;        // per object: units of its space in one of the scene's
};

}  // namespace solidtex::pathtracer
