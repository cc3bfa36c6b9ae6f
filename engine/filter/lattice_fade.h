// What the lattice family's footprints see above the coarsest level of the pyramid.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/filter/footprint.h"
#include "engine/lattice/lattice.h"

namespace solidtex::engine {

// Means of 2^3 voxels each, in place; `size` and values are [x][y][z][channel], all even.
void halve(std::array<std::int64_t, 3>& size, std::size_t channels, float* values);

// From one step to the next footprints double.
inline constexpr int kFadeSteps = 2;

// Predicts averages in light over edges of 2^level, 2^(level + 1) and 2^(level + 2) texels from a
// voxel of `level`: as it is, by a line that is fitted to boxes of the texture far from each other,
// and by the mean of all.
//
// Computing coarser voxels instead would cost eight times as much from one level to the next, and
// predicting one step more gained nothing: averages over 32^3 texels of granite and stone deviate
// from the mean by less than a tenth of the texture's deviation. Features of the network's own
// coarse levels were tried as predictors: they explain 2 to 23 % of the variance of averages over
// 8^3 texels of granite, rust and rock, 35 % of paint.
std::vector<FadeStep> fade_steps_of(const Lattice& lattice, const LightChannels& light, int level);

}  // namespace solidtex::engine
