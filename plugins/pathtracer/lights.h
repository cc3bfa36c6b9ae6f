// All that emits by design: the environment and the rectangles, picked with equal probability.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <limits>
#include <optional>
#include <vector>

#include "plugins/pathtracer/environment.h"

namespace solidtex::pathtracer {

struct LightSample {
  glm::vec3 direction{0};
  float distance = std::numeric_limits<float>::infinity();
  glm::vec3 radiance{0};
  float pdf = 0;  // per solid angle, the choice of the light included; 0: no light from here
};

class Lights {
 public:
  explicit Lights(const Scene& scene);

  bool empty() const { return light_count() == 0; }
  LightSample sample(const glm::vec3& from, float choice, const glm::vec2& u) const;

  // Radiance that a ray finds when it leaves the scene, or hits a rectangle, and the density with
  // which `sample` would have chosen that direction.
  LightSample environment_seen(const glm::vec3& direction) const;
  LightSample rectangle_seen(std::size_t index, const glm::vec3& direction, float distance) const;

 private:
  std::size_t light_count() const { return rectangles_.size() + (environment_ ? 1 : 0); }
  float choice_probability() const { return 1.0f / static_cast<float>(light_count()); }

  std::vector<RectangleLight> rectangles_;
  std::optional<Environment> environment_;
};

}  // namespace solidtex::pathtracer
