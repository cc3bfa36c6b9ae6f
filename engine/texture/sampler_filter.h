// Filtered values of the point family: means over footprints.
#pragma once

#include <cstddef>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "engine/sampler/sampler.h"
#include "engine/texture/axes.h"
#include "engine/texture/footprint.h"
#include "engine/texture/sampler_fade.h"

namespace solidtex::engine {

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
  void evaluate(std::span<const PlacedFootprint> footprints, const Answers& answers) const;

 private:
  struct Measured {
    std::vector<FadeStep> steps;
    EqualCube cube;
  };
  struct PartList;

  void append_parts(const Axes& axes, const Axes::Axis& middle, PartList& parts) const;
  void evaluate(const PartList& parts, const Answers& answers) const;

  const Sampler& sampler_;
  const LightChannels& light_;
  mutable std::once_flag once_;
  mutable std::optional<Measured> measured_;
};

}  // namespace solidtex::engine
