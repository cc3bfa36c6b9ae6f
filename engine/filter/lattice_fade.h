// Footprints of the lattice family beyond the coarsest level of the pyramid.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/filter/footprint.h"
#include "engine/lattice/lattice.h"

namespace solidtex::engine {

// Averages 2^3 voxels each, in place. `size` and values are [x][y][z][channel], all sizes even.
void halve(std::array<std::int64_t, 3>& size, std::size_t channels, float* values);

// Steps beyond the coarsest level; footprints double from one to the next.
inline constexpr int kFadeSteps = 2;

// Returns the steps that predict means over edges of 2^level, 2^(level + 1) and 2^(level + 2)
// texels from a voxel of `level`, in linear light: unchanged, by a line fitted to distant boxes of
// the texture, and by the mean of all boxes.
//
// A coarser level costs eight times as much as the one before it.
// docs/experiments/engine-constants.md says how much a prediction misses.
std::vector<FadeStep> fade_steps_of(const Lattice& lattice, const LightChannels& light, int level);

}  // namespace solidtex::engine
