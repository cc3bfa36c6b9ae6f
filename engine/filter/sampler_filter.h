// Filtered values of the point family: means over footprints.
#pragma once

#include <cstddef>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "engine/filter/axes.h"
#include "engine/filter/footprint.h"
#include "engine/sampler/sampler.h"

namespace solidtex::engine {

// For points without a footprint and for edges of 1, 2, 4 ... 2^kCoarsest texels: the line that
// predicts the mean over a cube, in light, best from the value with faded octaves in its middle.
// Fitted to cubes far from each other, whose means are those of points at random inside.
std::vector<FadeStep> fade_steps_of(const Sampler& sampler, const LightChannels& light);

// Which cube leaves as much of the octaves as a footprint does: the correction is that of its edge.
class EqualCube {
 public:
  explicit EqualCube(const Sampler& sampler);

  float radius(float kept) const;

 private:
  std::vector<float> kept_;  // of cubes with the radii radius_at(i), descending
};

// A footprint of any number of them.
struct PlacedFootprint {
  std::size_t point;  // which
  Axes::Axis middle;
  Axes axes;
};

class SamplerFilter {
 public:
  // Keeps references to both.
  SamplerFilter(const Sampler& sampler, const LightChannels& light)
      : sampler_(sampler), light_(light) {}

  // Measures the material, once, in tenths of a second. Before the first evaluation.
  void prepare() const;

  // The answer of each footprint's point becomes the mean of its parts, with octaves faded. Those
  // alone would shift the tones, since the network is not linear: what they give is corrected by
  // what was measured. None of them may be a point.
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
  mutable std::once_flag once_;
  mutable std::optional<Measured> measured_;
};

}  // namespace solidtex::engine
