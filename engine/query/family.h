// Interface of a model family: queries with checked arguments.
#pragma once

#include <memory>

#include "engine/cache/brick_cache.h"
#include "engine/common/box.h"
#include "engine/common/output_view.h"
#include "engine/common/scratch.h"
#include "engine/filter/footprint.h"
#include "engine/lattice/lattice.h"
#include "engine/query/coordinates.h"
#include "engine/sampler/sampler.h"

namespace solidtex::engine {

class Family {
 public:
  virtual ~Family() = default;
  // Evaluates points, averaged over their footprints.
  virtual void eval(const PointBatch& batch, const Footprints& footprints,
                    const OutputView& output) const = 0;
  virtual void eval_box(const Box& box, float* values) const = 0;
  virtual CacheStats cache_stats() const { return {}; }
  virtual ScratchMeter& scratch() const = 0;
};

// Makes a lattice family: evaluates boxes in parallel blocks and reconstructs points from bricks.
std::unique_ptr<Family> make_lattice_family(Lattice lattice, LightChannels light,
                                            std::uint64_t cache_limit_bytes);

// Makes a sampler family: evaluates every point, and a voxel as the point at its center.
std::unique_ptr<Family> make_sampler_family(Sampler sampler, LightChannels light);

}  // namespace solidtex::engine
