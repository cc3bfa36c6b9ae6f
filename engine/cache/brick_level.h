// One level of the prefiltered pyramid of a lattice, in cached bricks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/cache/brick_cache.h"
#include "engine/cache/brick_grid.h"
#include "engine/common/output_view.h"
#include "engine/common/points.h"
#include "engine/filter/footprint.h"
#include "engine/lattice/lattice.h"

namespace solidtex::engine {

// Voxels of level 0 are values as stored. Voxels of level k + 1 are means of 2^3 voxels of level k
// in linear light. A voxel depends only on its position, not on its brick.
class BrickLevel {
 public:
  // Keeps references to `lattice` and `light`.
  BrickLevel(const Lattice& lattice, const LightChannels& light, BrickGrid grid,
             std::uint64_t cache_limit_bytes);

  // Evaluates the points `which` of a batch (PointBatch or PositionBatch). Output i belongs to
  // which[i].
  template <class Batch>
  void evaluate(const Batch& batch, std::span<const std::uint32_t> which,
                const OutputView& output) const;

  CacheStats cache_stats() const { return cache_.stats(); }

 private:
  void build(const BrickKey& key, std::span<float> values) const;

  const Lattice& lattice_;
  const LightChannels& light_;
  BrickGrid grid_;
  std::size_t channels_;
  mutable BrickCache cache_;
};

}  // namespace solidtex::engine
