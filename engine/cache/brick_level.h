// One level of the lattice family's prefiltered pyramid, in cached bricks.
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

// Voxels of level 0 are the texture's as stored. Those of the others are means in light: each of
// level k + 1 is that of eight of level k, so that it depends on its position only, whatever brick
// it is computed in.
class BrickLevel {
 public:
  // Keeps references to `lattice` and `light`.
  BrickLevel(const Lattice& lattice, const LightChannels& light, BrickGrid grid,
             std::uint64_t cache_limit_bytes);

  // The points `which` of a batch (PointBatch or PositionBatch), interpolated between voxels:
  // answer i belongs to which[i].
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
