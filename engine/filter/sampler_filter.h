// Means of the sampler family over footprints.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "engine/common/once.h"
#include "engine/filter/axes.h"
#include "engine/filter/footprint.h"
#include "engine/sampler/sampler.h"

namespace solidtex::engine {

// Returns fade steps for points without a footprint and for cubes with edges of 1, 2, 4 ...
// 2^kCoarsest texels. A step predicts the mean over a cube, in linear light, from the value at its
// center with faded octaves. It is fitted to distant cubes, whose means come from random points.
std::vector<FadeStep> fade_steps_of(const Sampler& sampler, const LightChannels& light);

// Finds the cube that fades octaves as much as a footprint does. Its edge selects the fade step.
class EqualCube {
 public:
  explicit EqualCube(const Sampler& sampler);

  float radius(float kept) const;

 private:
  std::vector<float> kept_;  // for cubes with the radii radius_at(i), descending
};

// Footprint of one point of a list.
struct PlacedFootprint {
  std::size_t point;  // index of the point
  Axes::Axis middle;
  Axes axes;
};

class SamplerFilter {
 public:
  // Keeps references to both.
  SamplerFilter(const Sampler& sampler, const LightChannels& light)
      : sampler_(sampler), light_(light) {}

  // Measures the material once. Call it before the first evaluation.
  void prepare() const;

  // Writes the mean over each footprint to the output of its point: the mean of its parts,
  // evaluated with faded octaves and corrected by a fade step, since the network is not linear. No
  // footprint may be a point.
  void evaluate(std::span<const PlacedFootprint> footprints, const OutputView& output) const;

 private:
  struct Measured {
    std::vector<FadeStep> steps;
    EqualCube cube;
  };
  struct PartList;

  void append_parts(const Axes& axes, const Axes::Axis& middle, PartList& parts) const;
  void evaluate(const PartList& parts, const OutputView& output) const;

  const Sampler& sampler_;
  const LightChannels& light_;
  mutable Once once_;
  mutable std::optional<Measured> measured_;
};

}  // namespace solidtex::engine
