// What the point family's faded octaves are corrected by.
#pragma once

#include <vector>

#include "engine/sampler/sampler.h"
#include "engine/texture/footprint.h"

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

}  // namespace solidtex::engine
