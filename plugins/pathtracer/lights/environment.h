// Light from infinitely far away, sampled in proportion to its brightness.
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

// Finds where a uniform number falls in a cumulative table.
class CumulativeTable {
 public:
  explicit CumulativeTable(std::span<const double> shares);

  double total() const { return total_; }

  // The interval that u falls into, and how far (0 to 1) into it.
  struct Interval {
    int index;
    float fraction;
  };
  Interval find(float u) const;
  // Fetches the memory that find(u) will most probably need.
  void prefetch(float u) const { __builtin_prefetch(&entries_[step_of(u)]); }

 private:
  std::size_t step_of(float u) const {
    const auto step = static_cast<std::size_t>(u * static_cast<float>(entries_.size()));
    return std::min(step, entries_.size() - 1);
  }

  // The share of all up to here (u itself has no more digits), and, among as many equal steps of u,
  // the interval in which this one begins: mostly a near neighbour, so that a look-up stays in a
  // line of memory or two, where bisection read four or five and two arrays of doubles took 8 % of
  // a frame of a million triangles under a sky of 512 x 256 pixels.
  struct Entry {
    float sum;
    std::int32_t start;
  };
  std::vector<Entry> entries_;
  double total_ = 0;
};

// What is seen in a direction: radiance, and the density per solid angle with which sampling lights
// chooses that direction.
struct SeenLight {
  glm::vec3 radiance{0};
  float pdf = 0;
};

// Latitude-longitude image: +y is up, its centre looks along +z, x grows to the left edge
// (OpenEXR's convention). Bilinear in the image.
class Environment {
 public:
  explicit Environment(const EnvironmentImage& description);

  // From each direction.
  void seen(std::span<const glm::vec3> directions, std::span<SeenLight> found) const;

  struct Sample {
    glm::vec3 direction;
    SeenLight seen;
  };
  // For as many pairs of numbers from [0, 1).
  void sample(std::span<const glm::vec2> u, std::span<Sample> samples) const;

  // Of all directions together: luminance times solid angle.
  double luminance_of_all() const;

 private:
  struct Directions;
  struct Places;
  void look_up(int count, Places& places, SeenLight* found) const;
  void sample_some(int count, const glm::vec2* u, Sample* samples) const;
  void weigh_pixels();

  // Radiance and, as w, the share with which the pixel is chosen: neighbours in memory, as they are
  // needed together.
  std::vector<glm::vec4> texels_;
  int width_, height_;
  float rotation_;  // in turns
  // Cumulative power of rows, and of pixels within their row. The density is constant over the
  // solid angle of a pixel.
  std::vector<CumulativeTable> pixels_;  // per row
  std::optional<CumulativeTable> rows_;
  std::vector<float> heights_;  // of the rows' edges on the unit sphere, from above
  float density_per_weight_ = 0;
};

}  // namespace solidtex::pathtracer
