// Texture behind solidtex.h: queries of either family, checked, parallel and counted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "engine/cache/brick_cache.h"
#include "engine/common/output_view.h"
#include "engine/common/points.h"
#include "engine/common/progress.h"
#include "engine/common/scratch.h"
#include "engine/model/model.h"
#include "engine/sampler/sampler.h"

namespace solidtex::engine {

// Points and voxels evaluated so far.
struct QueryCounts {
  std::uint64_t points = 0, voxels = 0;
};

// Immutable except for its cache and counters. Any number of threads may query it. A query checks
// its arguments and throws Error before it writes.
class Texture {
 public:
  // `threads` is the size of the arena in which queries run, 0 for the calling thread's arena.
  // `period` is in texels, 0 for a solid that does not repeat (lattice family).
  Texture(Model model, std::uint64_t seed, std::uint64_t cache_limit_bytes,
          Precision precision = Precision::full, int threads = 0, std::uint64_t period = 0);
  ~Texture();

  // Returns the metadata of the model. Its tensors have moved into the family.
  const Model& model() const;

  // Evaluates points, averaged over their footprints. Point p is origin + points[3p .. 3p+2].
  void eval(const double origin[3], const float* points, const Footprints& footprints,
            std::size_t count, const OutputView& output) const;
  // Evaluates the voxels [origin, origin + size) into values in the order [x][y][z][channel].
  void eval_box(const std::int64_t origin[3], const std::int64_t size[3], float* values) const;

  CacheStats cache_stats() const;
  QueryCounts query_counts() const;
  const ScratchMeter& scratch() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace solidtex::engine
