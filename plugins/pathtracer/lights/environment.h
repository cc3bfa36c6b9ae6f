// Environment light from a latitude-longitude image, importance-sampled by luminance.
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

// A discrete distribution, sampled by its cumulative sums.
class CumulativeTable {
 public:
  explicit CumulativeTable(std::span<const double> weights);

  double total() const { return total_; }

  // The sampled entry and the relative position (0 to 1) in its interval.
  struct Interval {
    int index;
    float fraction;
  };
  Interval sample(float u) const;
  // Prefetches the memory that sample(u) most likely reads.
  void prefetch(float u) const { __builtin_prefetch(&entries_[step_of(u)]); }

 private:
  std::size_t step_of(float u) const {
    const auto step = static_cast<std::size_t>(u * static_cast<float>(entries_.size()));
    return std::min(step, entries_.size() - 1);
  }

  // The normalized sum up to this entry (float, as u has no more digits), and the first interval of
  // this entry's step of u, of as many equal steps as entries. The interval is mostly near its
  // step, so a look-up reads one or two cache lines; bisection reads four or five.
  struct Entry {
    float sum;
    std::int32_t start;
  };
  std::vector<Entry> entries_;
  double total_ = 0;
};

// Emission from a direction: radiance, and the density per solid angle with which light sampling
// chooses the direction.
struct EmittedLight {
  glm::vec3 radiance{0};
  float pdf = 0;
};

// Latitude-longitude image in OpenEXR's convention: +y is up, the center is +z, +x is towards the
// left edge. Bilinear in the image.
class Environment {
 public:
  explicit Environment(const EnvironmentImage& description);

  // Sets lights[i] to the emission from directions[i].
  void evaluate(std::span<const glm::vec3> directions, std::span<EmittedLight> lights) const;

  struct Sample {
    glm::vec3 direction;
    EmittedLight light;
  };
  // `u`: uniform pairs in [0, 1).
  void sample(std::span<const glm::vec2> u, std::span<Sample> samples) const;

  // Integral of luminance over the sphere.
  double total_luminance() const;

 private:
  struct Directions;
  struct Places;
  void look_up(int count, Places& places, EmittedLight* lights) const;
  void sample_batch(int count, const glm::vec2* u, Sample* samples) const;
  void weigh_pixels();

  // Radiance and, in w, the sampling weight: read together.
  std::vector<glm::vec4> texels_;
  int width_, height_;
  float rotation_;  // in turns
  // Distributions of rows, and of pixels within a row. The density is constant over the solid angle
  // of a pixel.
  std::vector<CumulativeTable> pixels_;  // per row
  std::optional<CumulativeTable> rows_;
  std::vector<float> heights_;  // y of the rows' edges on the unit sphere, from the top
  float density_per_weight_ = 0;
};

}  // namespace solidtex::pathtracer
