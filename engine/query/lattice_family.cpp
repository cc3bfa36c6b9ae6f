#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <vector>

#include "engine/cache/brick_level.h"
#include "engine/common/once.h"
#include "engine/common/parallel.h"
#include "engine/filter/axes.h"
#include "engine/filter/footprint.h"
#include "engine/filter/lattice_fade.h"
#include "engine/query/blocks.h"
#include "engine/query/family.h"

namespace solidtex::engine {
namespace {

constexpr std::array<std::int64_t, 3> kColumn = {256, 64, 64};
constexpr std::int64_t kMinBlockEdge = 16;
constexpr std::size_t kBlocksPerThread = 4;
// Points sorted by brick at a time: bounds the memory of a query.
constexpr std::size_t kSortedPoints = std::size_t{1} << 18;

// Returns the size of blocks: columns along x, which need no margin on that axis. Wide columns
// waste less margin on the other axes; narrow ones keep more threads busy and their plane rings in
// the second-level cache. A box with too few columns is also cut along x.
std::array<std::int64_t, 3> block_size(const Box& box) {
  const auto threads = static_cast<std::size_t>(max_threads());
  std::array<std::int64_t, 3> size = kColumn;
  while (threads > 1 && BlockSplit(box, size).count() < kBlocksPerThread * threads) {
    const auto longest = std::max_element(size.begin(), size.end());
    if (*longest <= kMinBlockEdge) break;
    *longest /= 2;
  }
  return size;
}

// Pyramid of levels and their brick sizes. A brick of a coarse level covers about 32^3 texels. A
// voxel of level k costs as much as 8^k texels, so there is no level beyond 3.
constexpr BrickGrid kGrids[] = {{0, 4}, {1, 4}, {2, 3}, {3, 2}};
// Reconstruction blurs once more: a level finer than the footprint comes closest to the true mean.
// See docs/experiments/engine-constants.md.
constexpr float kFinerEdge = 0.75f;
// An elongated footprint is split into at most kMaxParts parts. A part with a reach of half a texel
// is as good as a point.
constexpr int kMaxParts = 16;
constexpr double kMinReach = 0.5;
constexpr int kLevels = static_cast<int>(std::size(kGrids));

class LatticeFamily : public Family {
 public:
  LatticeFamily(Lattice lattice, LightChannels light, std::uint64_t cache_limit_bytes)
      : lattice_(std::move(lattice)), light_(std::move(light)), channels_(light_.count()) {
    // The finest level gets most of the memory. The others share the rest equally.
    const std::uint64_t coarse_limit = cache_limit_bytes / 8;
    for (const BrickGrid& grid : kGrids) {
      const std::uint64_t finest_limit = cache_limit_bytes - (kLevels - 1) * coarse_limit;
      levels_.push_back(std::make_unique<BrickLevel>(
          lattice_, light_, grid, grid.level == 0 ? finest_limit : coarse_limit));
    }
  }

  void eval(const PointBatch& batch, const Footprints& footprints,
            const OutputView& output) const override {
    if (footprints.axes) return eval_axes(batch, footprints.axes, output);
    for_each_chunk(batch, [&](const PointBatch& part, std::size_t begin) {
      const OutputView part_output = output.from(begin * channels_);
      if (footprints.radii) {
        filter(part, footprints.radii + begin, part_output);
      } else {
        levels_[0]->evaluate(part, all_of(part), part_output);
      }
    });
  }

  void eval_box(const Box& box, float* values) const override {
    const BlockSplit blocks(box, block_size(box));
    const auto channels = static_cast<std::ptrdiff_t>(channels_);
    const std::ptrdiff_t y_pitch = box.size(2) * channels, x_pitch = box.size(1) * y_pitch;
    for_each_part(blocks.count(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t index = begin; index < end; ++index) {
        const Box block = blocks.block(index);
        float* corner = values + (block.lo[0] - box.lo[0]) * x_pitch +
                        (block.lo[1] - box.lo[1]) * y_pitch + (block.lo[2] - box.lo[2]) * channels;
        lattice_.evaluate(block, BoxTarget{corner, x_pitch, y_pitch});
      }
    });
  }

  ScratchMeter& scratch() const override { return lattice_.scratch(); }

  CacheStats cache_stats() const override {
    CacheStats total;
    for (const auto& level : levels_) total += level->cache_stats();
    return total;
  }

 private:
  void eval_axes(const PointBatch& batch, const float* axes, const OutputView& output) const {
    const std::size_t step = kSortedPoints / kMaxParts;
    for (std::size_t begin = 0; begin < batch.count; begin += step) {
      const ProgressScope progress(begin / step, (batch.count + step - 1) / step);
      Lookups lookups;
      for (std::size_t p = begin; p < std::min(begin + step, batch.count); ++p)
        lookups.add({batch.coordinate(p, 0), batch.coordinate(p, 1), batch.coordinate(p, 2)},
                    Axes::of(axes + 9 * p));
      average(lookups, output.from(begin * channels_));
    }
  }

  template <class Work>
  static void for_each_chunk(const PointBatch& batch, const Work& work) {
    const std::size_t chunks = (batch.count + kSortedPoints - 1) / kSortedPoints;
    for (std::size_t begin = 0; begin < batch.count; begin += kSortedPoints) {
      const ProgressScope progress(begin / kSortedPoints, chunks);
      work(PointBatch{batch.origin, batch.points + 3 * begin,
                      std::min(kSortedPoints, batch.count - begin)},
           begin);
    }
  }

  static std::vector<std::uint32_t> all_of(const PointBatch& batch) {
    std::vector<std::uint32_t> which(batch.count);
    std::iota(which.begin(), which.end(), 0u);
    return which;
  }

  // Parts in which some footprints are looked up.
  struct Lookups {
    std::vector<double> positions;
    std::vector<float> radii;
    std::vector<int> counts;  // parts per footprint

    std::size_t bytes() const {
      return positions.size() * sizeof(double) + radii.size() * sizeof(float) +
             counts.size() * sizeof(int);
    }
    void add(const Axes::Axis& middle, const Axes& axes) {
      const Parts parts = cut(axes, kMaxParts, kMinReach);
      for_each_middle(parts, [&](const Axes::Axis& step) {
        for (std::size_t k = 0; k < 3; ++k) positions.push_back(middle[k] + step[k]);
        radii.push_back(static_cast<float>(parts.reach));
      });
      counts.push_back(parts.total());
    }
  };

  // Averages the parts of each footprint.
  void average(const Lookups& lookups, OutputView output) const {
    const std::size_t count = lookups.radii.size();
    OutputBuffer buffer(count * channels_, output.jacobians != nullptr);
    const OutputView found = buffer;
    const ScratchUse use(scratch(), lookups.bytes() + buffer.bytes());
    look_up(PositionBatch{lookups.positions.data(), count}, lookups.radii.data(), found);
    std::size_t part = 0;
    for (const int parts : lookups.counts) {
      mean_of(found.from(part * channels_), static_cast<std::size_t>(parts), channels_, output);
      if (lookups.radii[part] > 0) light_.from_light(output, 1);
      part += static_cast<std::size_t>(parts);
      output = output.from(channels_);
    }
  }

  void filter(const PointBatch& batch, const float* radii, const OutputView& output) const {
    look_up(batch, radii, output);
    for (std::size_t point = 0; point < batch.count; ++point)
      if (radii[point] > 0) light_.from_light(output.from(point * channels_), 1);
  }

  // Adds the shares of the levels of the pyramid, in linear light where a point has a footprint and
  // as stored where it has none. A point uses one level or two, the finer one first.
  template <class Batch>
  void look_up(const Batch& batch, const float* radii, const OutputView& output) const {
    output.for_both([&](auto member, std::size_t width) {
      std::fill_n(output.*member, width * batch.count * channels_, 0.0f);
    });
    std::array<std::vector<std::uint32_t>, kLevels> points_of;
    std::size_t all = 0, done = 0;
    for (int level = 0; level < kLevels; ++level) {
      auto& which = points_of[static_cast<std::size_t>(level)];
      for (std::uint32_t point = 0; point < batch.count; ++point)
        if (share_of(level, radii[point]) > 0) which.push_back(point);
      all += which.size();
    }
    const ScratchUse use_of_lists(scratch(), all * sizeof(std::uint32_t));
    for (int level = 0; level < kLevels; ++level) {
      const auto& which = points_of[static_cast<std::size_t>(level)];
      if (which.empty()) continue;
      const auto part_of_all = [all](std::size_t points) {
        return static_cast<double>(points) / static_cast<double>(all);
      };
      const ProgressScope progress(part_of_all(done), part_of_all(done + which.size()));
      done += which.size();
      OutputBuffer buffer(which.size() * channels_, output.jacobians != nullptr);
      const OutputView found = buffer;
      const ScratchUse use(scratch(), buffer.bytes());
      levels_[static_cast<std::size_t>(level)]->evaluate(batch, which, found);
      for (std::size_t i = 0; i < which.size(); ++i) {
        const bool is_encoded = level == 0 && radii[which[i]] > 0;
        const OutputView part = found.from(i * channels_), sum = output.from(which[i] * channels_);
        if (is_encoded) light_.to_light(part, 1);
        const float share = share_of(level, radii[which[i]]);
        output.for_both([&](auto member, std::size_t width) {
          for (std::size_t c = 0; c < width * channels_; ++c)
            (sum.*member)[c] = std::fma(share, (part.*member)[c], (sum.*member)[c]);
        });
      }
    }
    for (std::size_t point = 0; point < batch.count; ++point) {
      const FootprintScale scale(kFinerEdge * radii[point]);
      if (scale.level < kLevels - 1) continue;
      const auto step = static_cast<std::size_t>(scale.level - (kLevels - 1));
      fade(fade_steps(), step, scale.fraction, output.from(point * channels_));
    }
  }

  // Returns the weight of a level in a footprint's value. At most two neighboring levels share it.
  static float share_of(int level, float radius) {
    const FootprintScale scale(kFinerEdge * radius);
    if (scale.level < 0) return level == 0 ? 1.0f : 0.0f;
    if (scale.level >= kLevels - 1 + kFadeSteps) return 0;  // only the mean remains
    if (scale.level >= kLevels - 1) return level == kLevels - 1 ? 1.0f : 0.0f;
    if (level == scale.level) return 1 - scale.fraction;
    return level == scale.level + 1 ? scale.fraction : 0.0f;
  }

  // Measures the material on first use.
  const std::vector<FadeStep>& fade_steps() const {
    const ProgressScope at_the_end(1.0, 1.0);
    measured_.run([&] { fade_steps_ = fade_steps_of(lattice_, light_, kLevels - 1); });
    return fade_steps_;
  }

  Lattice lattice_;
  LightChannels light_;
  std::size_t channels_;
  std::vector<std::unique_ptr<BrickLevel>> levels_;
  mutable Once measured_;
  mutable std::vector<FadeStep> fade_steps_;
};

}  // namespace

std::unique_ptr<Family> make_lattice_family(Lattice lattice, LightChannels light,
                                            std::uint64_t cache_limit_bytes) {
  return std::make_unique<LatticeFamily>(std::move(lattice), std::move(light), cache_limit_bytes);
}

}  // namespace solidtex::engine
