// What the lattice family's footprints see above the coarsest level of the pyramid.
#pragma once

#include <vector>

#include "engine/field/field.h"
#include "engine/texture/footprint.h"

namespace solidtex::engine {

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
std::vector<FadeStep> fade_steps_of(const Field& field, const LightChannels& light, int level);

}  // namespace solidtex::engine
