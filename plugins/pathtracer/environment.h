// Light from infinitely far away, sampled in proportion to its brightness.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "plugins/pathtracer/scene.h"

namespace solidtex::pathtracer {

struct DirectionSample {
  glm::vec3 direction{0};
  float pdf = 0;  // per solid angle
};

// Latitude-longitude image: +y is up, its centre looks along +z, x grows to the left edge
// (OpenEXR's convention). Bilinear in the image.
class Environment {
 public:
  explicit Environment(const EnvironmentImage& description);

  glm::vec3 radiance(const glm::vec3& direction) const;
  DirectionSample sample(const glm::vec2& u) const;
  float pdf(const glm::vec3& direction) const;

 private:
  glm::vec2 to_uv(const glm::vec3& direction) const;
  glm::vec3 lookup(float u, float v) const;
  float mean_luminance(int x, int y) const;
  float density(int x, int y) const;

  ColorImage image_;
  float rotation_;  // in turns
  // Cumulative power of rows, and of pixels within their row. The density is constant over the
  // solid angle of a pixel.
  std::vector<double> row_sums_;
  std::vector<double> pixel_sums_;
  std::vector<float> weights_;
};

}  // namespace solidtex::pathtracer
