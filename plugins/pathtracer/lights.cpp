#include "plugins/pathtracer/lights.h"

#include <algorithm>

namespace solidtex::pathtracer {

Lights::Lights(const Scene& scene) : rectangles_(scene.lights) {
  if (scene.environment) environment_.emplace(*scene.environment);
}

LightSample Lights::sample(const glm::vec3& from, float choice, const glm::vec2& u) const {
  const auto index = std::min(static_cast<std::size_t>(choice * static_cast<float>(light_count())),
                              light_count() - 1);
  if (index == rectangles_.size()) {
    const DirectionSample chosen = environment_->sample(u);
    return {chosen.direction, std::numeric_limits<float>::infinity(),
            environment_->radiance(chosen.direction), chosen.pdf * choice_probability()};
  }
  const RectangleLight& light = rectangles_[index];
  const glm::vec3 to_light = light.corner + u.x * light.edge_u + u.y * light.edge_v - from;
  const float distance = glm::length(to_light);
  if (distance <= 0) return {};
  return rectangle_seen(index, to_light / distance, distance);
}

LightSample Lights::environment_seen(const glm::vec3& direction) const {
  if (!environment_) return {};
  return {direction, std::numeric_limits<float>::infinity(), environment_->radiance(direction),
          environment_->pdf(direction) * choice_probability()};
}

LightSample Lights::rectangle_seen(std::size_t index, const glm::vec3& direction,
                                   float distance) const {
  const RectangleLight& light = rectangles_[index];
  const glm::vec3 area_normal = glm::cross(light.edge_u, light.edge_v);  // length: the area
  const float projected_area = -glm::dot(area_normal, direction);
  if (projected_area <= 0) return {};
  return {direction, distance, light.radiance,
          distance * distance / projected_area * choice_probability()};
}

}  // namespace solidtex::pathtracer
