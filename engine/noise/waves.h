// Sines of a linear phase at lattice points: the periodic operation of the lattice family.
#pragma once

#include "engine/noise/reference.h"

namespace solidtex::engine {

// Returns the wave with whole turns in `period` voxels, the nearest ones. 0 is no period.
Wave with_period(const Wave& wave, std::int64_t period);

namespace reference {

// values[i] = sine at point i.
void waves(const Wave& wave, const LatticePoints& points, int count, float* values);

}  // namespace reference

// The same on the active target, with the bits of the reference.
void waves(const Wave& wave, const LatticePoints& points, int count, float* values);

}  // namespace solidtex::engine
