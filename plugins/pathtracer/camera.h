// The pinhole camera: rays through the pixels of a picture.
#pragma once

#include <cmath>
#include <glm/glm.hpp>

#include "plugins/pathtracer/embree_scene.h"

namespace solidtex::pathtracer {

class CameraRays {
 public:
  // A pixel's cone is shared out among its samples.
  CameraRays(const Camera& camera, int width, int height, int samples)
      : origin_(camera.position), width_(width), height_(height) {
    const glm::vec3 forward = glm::normalize(camera.look_at - camera.position);
    const glm::vec3 right = glm::normalize(glm::cross(forward, camera.up));
    // The picture at distance 1 is 2 tan(fov / 2) high, and its pixels are square.
    const float half_height = std::tan(glm::radians(camera.fov_degrees) / 2);
    const float pixel = 2 * half_height / static_cast<float>(height);
    forward_ = forward;
    spread_ = 0.5f * pixel / std::sqrt(static_cast<float>(samples));
    step_x_ = right * pixel;
    step_y_ = -glm::cross(right, forward) * pixel;
  }

  // (x, y) in pixels, (0, 0) the upper left corner of the picture.
  Ray ray(float x, float y) const {
    const glm::vec3 direction = forward_ + step_x_ * (x - 0.5f * static_cast<float>(width_)) +
                                step_y_ * (y - 0.5f * static_cast<float>(height_));
    return {.origin = origin_, .direction = glm::normalize(direction), .spread = spread_};
  }

 private:
  glm::vec3 origin_, forward_, step_x_, step_y_;
  float spread_ = 0;
  int width_, height_;
};

}  // namespace solidtex::pathtracer
