// Samples the lights and the environment, roughly in proportion to their power. Light indices count
// rectangles, then spheres, then meshes, then the environment.
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
  float pdf = 0;  // per solid angle, times the probability of the light; 0: rejected
};

// A ray that hit a light.
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

  bool empty() const { return probabilities_.empty(); }

  // Samples a light for each point. One pair u chooses the light and the position on it, so that
  // each light gets a stratified subset of the pairs.
  void sample(std::span<const glm::vec3> from, std::span<const glm::vec2> u,
              std::span<LightSample> samples) const;

  // Emission towards rays that leave the scene or hit a light.
  void evaluate_environment(std::span<const glm::vec3> directions,
                            std::span<EmittedLight> lights) const;
  EmittedLight evaluate(const LightHit& hit) const;

 private:
  std::size_t shape_count() const {
    return scene_.lights.size() + scene_.sphere_lights.size() + scene_.mesh_lights.size();
  }
  LightSample sample_shape(std::size_t light, const glm::vec3& from, const glm::vec2& u) const;
  void sample_batch(std::span<const glm::vec3> from, std::span<const glm::vec2> u,
                    std::span<LightSample> samples) const;
  std::vector<double> powers() const;
  void choose_probabilities(const std::vector<double>& powers);

  const Scene& scene_;
  std::vector<std::vector<double>> area_sums_;  // per mesh: cumulative triangle areas
  std::optional<Environment> environment_;
  // Per light: selection probabilities and their cumulative sums.
  std::vector<float> probabilities_;
  std::vector<double> probability_sums_;
};

}  // namespace solidtex::pathtracer
