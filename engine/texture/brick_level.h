// One level of the lattice family's prefiltered pyramid, in cached bricks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/field/field.h"
#include "engine/texture/answers.h"
#include "engine/texture/brick_cache.h"
#include "engine/texture/coordinates.h"
#include "engine/texture/footprint.h"
#include "engine/texture/reconstruction.h"

namespace solidtex::engine {

// Voxels of level 0 are the texture's as stored. Those of the others are means in light: each of
// level k + 1 is that of eight of level k, so that it depends on its position only, whatever brick
// it is computed in.
class BrickLevel {
 public:
  // Keeps references to `field` and `light`.
  BrickLevel(const Field& field, const LightChannels& light, BrickGrid grid,
             std::uint64_t cache_limit_bytes);

  // The points `which` of a batch (PointBatch or PositionBatch), interpolated between voxels:
  // answer i belongs to which[i].
  template <class Batch>
  void evaluate(const Batch& batch, std::span<const std::uint32_t> which,
                const Answers& answers) const;

  CacheStats cache_stats() const { return cache_.stats(); }

 private:
  void build(const BrickKey& key, std::span<float> values) const;

  const Field& field_;
  const LightChannels& light_;
  BrickGrid grid_;
  std::size_t channels_;
  mutable BrickCache cache_;
};

// Means of 2^3 voxels each, in place; `size` and values are [x][y][z][channel], all even.
void halve(std::array<std::int64_t, 3>& size, std::size_t channels, float* values);

}  // namespace solidtex::engine
