// The query contract behind solidtex.h: points and boxes for either family, in parallel, cached.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "engine/cache/brick_cache.h"
#include "engine/common/output_view.h"
#include "engine/common/points.h"
#include "engine/common/progress.h"
#include "engine/model/model.h"
#include "engine/sampler/sampler.h"

namespace solidtex::engine {

// Points and voxels evaluated so far.
struct QueryCounts {
  std::uint64_t points = 0, voxels = 0;
};

// Immutable but for the cache and counters; queries may run on any number of threads. They check
// their arguments and throw Error before writing anything.
class Texture {
 public:
  // Queries run in an arena of so many threads, 0 for the calling thread's.
  Texture(Model model, std::uint64_t seed, std::uint64_t cache_limit_bytes,
          Precision precision = Precision::full, int threads = 0);
  ~Texture();

  // The model's facts. Its tensors have moved into the evaluator.
  const Model& model() const;

  // Evaluates points, averaged over their footprints. Point p is origin + points[3p .. 3p+2].
  void eval(const double origin[3], const float* points, const Footprints& footprints,
            std::size_t count, const OutputView& output) const;
  // Voxels [origin, origin + size); values in [x][y][z][channel] order.
  void eval_box(const std::int64_t origin[3], const std::int64_t size[3], float* values) const;

  CacheStats cache_stats() const;
  QueryCounts query_counts() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace solidtex::engine
