// Spatially seeded noise: a pure function of (seed, level, channel, x, y, z). See docs/noise.md.
#pragma once

#include <cstdint>

#include "engine/model/model.h"
#include "engine/noise/hash.h"
#include "engine/noise/reference.h"

namespace solidtex::engine {

// Noise of one channel on one level under one seed. Cheap to copy.
class NoiseStream {
 public:
  NoiseStream(NoiseScheme scheme, std::uint64_t seed, std::uint32_t level, std::uint32_t channel);

  // Scalar definition. Coordinates wrap modulo 2^32.
  float uniform(std::int32_t x, std::int32_t y, std::int32_t z) const;
  float normal(std::int32_t x, std::int32_t y, std::int32_t z) const;

  // Writes the values at the points of a plane of the lattice. Vectorized, with the bits of the
  // scalar definition.
  void plane(Distribution distribution, const LatticePoints& points, int count,
             float* values) const;

 private:
  NoiseScheme scheme_;
  std::uint64_t seed_;
  std::uint32_t level_, channel_;
  StreamKey key_;
};

// Throws Error if the scheme has no normal distribution.
void require_normal(NoiseScheme scheme);

}  // namespace solidtex::engine
