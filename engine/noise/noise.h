// Spatially seeded noise: a pure function of (seed, level, channel, x, y, z). See docs/noise.md.
#pragma once

#include <cstdint>

#include "engine/model/model.h"
#include "engine/noise/hash.h"
#include "engine/noise/reference.h"

namespace solidtex::engine {

// One channel of one level under one seed; cheap to make and to copy.
class NoiseStream {
 public:
  NoiseStream(NoiseScheme scheme, std::uint64_t seed, std::uint32_t level, std::uint32_t channel);

  // Scalar definition. Coordinates are taken modulo 2^32.
  float uniform(std::int32_t x, std::int32_t y, std::int32_t z) const;
  float normal(std::int32_t x, std::int32_t y, std::int32_t z) const;

  // values[i] = value at point i of a plane of the lattice, vectorised, the same bits.
  void plane(Distribution distribution, const LatticePoints& points, int count,
             float* values) const;

 private:
  NoiseScheme scheme_;
  std::uint64_t seed_;
  std::uint32_t level_, channel_;
  StreamKey key_;
};

// Throws Error unless the scheme has a normal distribution.
void require_normal(NoiseScheme scheme);

}  // namespace solidtex::engine
