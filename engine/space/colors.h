// Colors of a photograph: mean and principal axes. Blends of materials. Both have the same bits on
// every machine.
#pragma once

#include <cstddef>
#include <span>

#include "engine/space/space.h"

namespace solidtex::engine {

// Returns the colors of pixels [pixel][channel] with three channels; at least two pixels.
Colors photograph_colors(std::span<const float> pixels);

// Blends codes, and means and covariances of colors, linearly. The weights are divided by their
// sum, which must be positive.
Material blend(const Space& space, std::span<const Material> materials,
               std::span<const double> weights);

}  // namespace solidtex::engine
