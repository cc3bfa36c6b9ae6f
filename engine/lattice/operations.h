// Noise, waves, and operations on whole blocks.
#pragma once

#include "engine/kernels/linear_layer.h"
#include "engine/lattice/block.h"
#include "engine/lattice/plane_ring.h"
#include "engine/model/model.h"
#include "engine/noise/noise.h"

namespace solidtex::engine {

struct LatticeNoise {
  NoiseScheme scheme;
  std::uint64_t seed;
  int level;
  Distribution distribution;
  std::int64_t period;  // in voxels of the level, 0 for none
};

// Fills the planes [x_lo, x_hi) of a ring with noise.
void fill_noise(const LatticeNoise& noise, const PlaneRing& ring, std::int64_t x_lo,
                std::int64_t x_hi);

// Fills the planes [x_lo, x_hi) of a ring with waves, one for each channel. `period` is in voxels
// of the level, 0 for none.
void fill_waves(const PeriodicOp& op, std::int64_t period, const PlaneRing& ring, std::int64_t x_lo,
                std::int64_t x_hi);

// Computes a node on a box from its input on the required box. `layer` holds the weights of a
// convolution.
Block apply(const Node& node, const LinearLayer& layer, const Block& in, const Box& box);

}  // namespace solidtex::engine
