// Camera rays of a pinhole or thin-lens camera.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <glm/gtc/constants.hpp>

#include "plugins/pathtracer/geometry/interaction.h"
#include "plugins/pathtracer/sampling/angles.h"
#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

class CameraRays {
 public:
  // Divides the cone of a pixel, and the lens, among the pixel's samples.
  CameraRays(const Camera& camera, int width, int height, int samples)
      : origin_(camera.position), width_(width), height_(height), aperture_(camera.aperture) {
    const glm::vec3 view = camera.look_at - camera.position;
    forward_ = glm::normalize(view);
    right_ = glm::normalize(glm::cross(forward_, camera.up));
    up_ = glm::cross(right_, forward_);
    // The image plane at distance 1 is 2 tan(fov / 2) high; pixels are square.
    const float half_height = std::tan(glm::radians(camera.fov_degrees) / 2);
    pixel_ = 2 * half_height / static_cast<float>(height);
    share_ = 1 / std::sqrt(static_cast<float>(samples));
    focus_ = camera.focus_distance > 0 ? camera.focus_distance : glm::length(view);
  }

  bool has_lens() const { return aperture_ > 0; }

  // (x, y) in pixels from the upper left corner; `lens`: uniform in [0, 1)^2.
  Ray ray(float x, float y, const glm::vec2& lens) const {
    const glm::vec3 direction = forward_ +
                                right_ * (pixel_ * (x - 0.5f * static_cast<float>(width_))) -
                                up_ * (pixel_ * (y - 0.5f * static_cast<float>(height_)));
    Ray ray{.origin = origin_, .direction = direction, .spread = 0.5f * pixel_ * share_};
    if (has_lens()) start_on_lens(ray, lens);
    ray.direction = glm::normalize(ray.direction);
    return ray;
  }

  // Distance from the camera along the view direction.
  float depth_of(const glm::vec3& point) const { return glm::dot(point - origin_, forward_); }

 private:
  // All rays of a pixel meet in the focal plane.
  void start_on_lens(Ray& ray, const glm::vec2& lens) const {
    const glm::vec2 point = aperture_ * std::sqrt(lens.x) * unit_circle(lens.y);
    const glm::vec3 offset = point.x * right_ + point.y * up_;
    ray.origin += offset;
    ray.direction = ray.direction * focus_ - offset;
    ray.radius = aperture_ * share_;
    ray.inverse_focus = 1 / glm::length(ray.direction);
  }

  glm::vec3 origin_, forward_{0}, right_{0}, up_{0};
  float pixel_ = 0, share_ = 1, focus_ = 1;  // pixel width at distance 1
  int width_, height_;
  float aperture_;
};

}  // namespace solidtex::pathtracer
