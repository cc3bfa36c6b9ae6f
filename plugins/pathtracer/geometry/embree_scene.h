// Ray queries on a scene. A mesh that several objects share is an Embree scene of its own,
// instanced once per object.
#pragma once

#include <memory>
#include <span>
#include <type_traits>
#include <vector>

#include "plugins/pathtracer/geometry/embree.h"
#include "plugins/pathtracer/geometry/interaction.h"
#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

class EmbreeScene {
 public:
  // Keeps a reference to `scene`.
  explicit EmbreeScene(const Scene& scene);

  Hit intersect(const Ray& ray) const;
  bool occluded(const ShadowRay& ray) const;

  // Queries in packets of neighboring rays. The bits are those of single queries
  // (tests/scenes/test_packets.cpp). `coherent`: neighbors are similar, as the rays of a pixel
  // are. docs/benchmarks.md has the gain.
  void intersect(std::span<const Ray> rays, bool coherent, std::span<Hit> hits) const;
  void occluded(std::span<const ShadowRay> rays, std::span<std::uint8_t> results) const;

  SurfaceInteraction interaction(const Ray& ray, const Hit& hit) const;

  // Returns a point slightly above the surface, on the side of `direction`, which avoids
  // self-intersection of rays that start there.
  glm::vec3 offset_ray_origin(const SurfaceInteraction& interaction,
                              const glm::vec3& direction) const;

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
  void attach_triangles(const Object& object, unsigned id);
  void attach_light(const RectangleLight& light, unsigned id);
  void attach_light(const SphereLight& light, unsigned id);
  void attach_light(const MeshLight& light, unsigned id);

  const Scene& scene_;
  Owned<RTCDevice> device_;
  int packet_width_;                     // the machine's vector width; 1: single rays
  std::vector<Owned<RTCScene>> meshes_;  // null for meshes of a single object
  Owned<RTCScene> root_;
  std::vector<glm::mat3> normal_matrices_;  // per object
  std::vector<float> object_scales_;        // per object: object units per world unit
};

}  // namespace solidtex::pathtracer
