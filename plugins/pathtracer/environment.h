// Light from infinitely far away, sampled in proportion to its brightness.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "plugins/pathtracer/scene.h"

namespace solidtex::pathtracer {

struct DirectionSample {
  glm::vec3 direction{0};
  float pdf = 0;  // per solid angle
};

// Finds where a uniform number falls in a cumulative table.
class CumulativeTable {
 public:
  void push_back(double sum) { sums_.push_back(sum); }
  void finish();  // after the last entry
  double total() const { return sums_.back(); }

  // The interval that u falls into, and how far (0 to 1) into it.
  struct Interval {
    int index;
    float fraction;
  };
  Interval find(float u) const;

 private:
  std::vector<double> sums_;
  // Where to begin to look, by equal steps of u: with it a look-up reads two lines of memory where
  // bisection read four or five. In a profile of a million triangles in a studio those reads were
  // about 4 % of the samples; the gain as a whole is within the noise of a busy machine.
  std::vector<std::int32_t> starts_;
};

// Latitude-longitude image: +y is up, its centre looks along +z, x grows to the left edge
// (OpenEXR's convention). Bilinear in the image.
class Environment {
 public:
  explicit Environment(const EnvironmentImage& description);

  glm::vec3 radiance(const glm::vec3& direction) const;
  // The radiance from a direction, and the density with which `sample` chooses it.
  struct Seen {
    glm::vec3 radiance;
    float pdf;
  };
  Seen seen(const glm::vec3& direction) const;
  float pdf(const glm::vec3& direction) const { return density_at(to_uv(direction)); }
  DirectionSample sample(const glm::vec2& u) const;

  // Of all directions together: luminance times solid angle.
  double luminance_of_all() const;

 private:
  glm::vec2 to_uv(const glm::vec3& direction) const;
  glm::vec3 lookup(float u, float v) const;
  float mean_luminance(int x, int y) const;
  float density(int x, int y) const;
  float density_at(const glm::vec2& uv) const;

  ColorImage image_;
  float rotation_;  // in turns
  // Cumulative power of rows, and of pixels within their row. The density is constant over the
  // solid angle of a pixel.
  CumulativeTable rows_;
  std::vector<CumulativeTable> pixels_;
  std::vector<float> weights_;
};

}  // namespace solidtex::pathtracer
