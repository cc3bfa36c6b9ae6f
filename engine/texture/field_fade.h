// What the lattice family's footprints see above the coarsest level of the pyramid.
#pragma once

#include <vector>

#include "engine/field/field.h"
#include "engine/texture/footprint.h"

namespace solidtex::engine {

// Predicts averages in light over edges of 2^level texels, 2^(level + 1), ... from a voxel of
// `level`: as it is, lines fitted to boxes of the texture far from each other, at last the mean of
// them all.
//
// Computing coarser bricks instead would cost eight times as much from one level to the next. A
// prediction from the network's own coarse features was tried: they explain 2 to 16 % of the
// variance of averages over 8^3 texels in granite, rust and rock, 34 % in paint.
std::vector<FadeStep> fade_steps_of(const Field& field, const LightChannels& light, int level);

}  // namespace solidtex::engine
