// All that emits by design: the environment and the lights, the brighter ones picked more often.
// Lights are numbered: rectangles, then spheres, then meshes, then the environment.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "plugins/pathtracer/lights/environment.h"

namespace solidtex::pathtracer {

struct LightSample {
  glm::vec3 direction{0};
  float distance = std::numeric_limits<float>::infinity();
  glm::vec3 radiance{0};
  float pdf = 0;  // per solid angle, the choice of the light included; 0: no light from here
};

// Where a ray hit a light.
struct LightHit {
  std::size_t light = 0;
  std::uint32_t triangle = 0;  // of a mesh
  glm::vec3 origin{0}, direction{0};
  float distance = 0;
};

class Lights {
 public:
  // Keeps a reference to `scene`.
  explicit Lights(const Scene& scene);

  bool empty() const { return shares_.empty(); }
  // A light for each point. One pair of numbers chooses the light and the place on it: so each
  // light's share of well distributed pairs is well distributed, too.
  void sample(std::span<const glm::vec3> from, std::span<const glm::vec2> u,
              std::span<LightSample> samples) const;

  // What rays find when they leave the scene, or hit a light.
  void environment_seen(std::span<const glm::vec3> directions, std::span<SeenLight> found) const;
  SeenLight light_seen(const LightHit& hit) const;

 private:
  std::size_t shape_count() const {
    return scene_.lights.size() + scene_.sphere_lights.size() + scene_.mesh_lights.size();
  }
  LightSample sample_shape(std::size_t light, const glm::vec3& from, const glm::vec2& u) const;
  void sample_some(std::span<const glm::vec3> from, std::span<const glm::vec2> u,
                   std::span<LightSample> samples) const;
  std::vector<double> powers() const;
  void choose_shares(const std::vector<double>& powers);

  const Scene& scene_;
  std::vector<std::vector<double>> area_sums_;  // per mesh: areas of the triangles up to each
  std::optional<Environment> environment_;
  // With which probability each light is picked, and the sums of these up to each.
  std::vector<float> shares_;
  std::vector<double> share_sums_;
};

}  // namespace solidtex::pathtracer
