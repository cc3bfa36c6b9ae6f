#include <algorithm>
#include <vector>

#include "engine/texture/blocks.h"
#include "engine/texture/family.h"
#include "engine/texture/parallel.h"
#include "engine/texture/trilinear.h"

namespace solidtex::engine {
namespace {

constexpr std::array<std::int64_t, 3> kColumn = {256, 64, 64};
constexpr std::int64_t kMinBlockEdge = 16;
constexpr std::size_t kBlocksPerThread = 4;
// Points are sorted by brick so many at a time, to bound the memory of a query.
constexpr std::size_t kSortedPoints = std::size_t{1} << 18;

// Columns along x, which costs no margin: wide ones waste less on the others, narrow ones keep more
// threads busy and their windows in the second cache. A box that is short of columns is cut along x
// as well.
std::array<std::int64_t, 3> block_size(const Box& box) {
  const auto threads = static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  std::array<std::int64_t, 3> size = kColumn;
  while (threads > 1 && BlockSplit(box, size).count() < kBlocksPerThread * threads) {
    const auto longest = std::max_element(size.begin(), size.end());
    if (*longest <= kMinBlockEdge) break;
    *longest /= 2;
  }
  return size;
}

struct PlacedPoint {
  BrickKey brick;
  std::uint32_t index;
  friend auto operator<=>(const PlacedPoint&, const PlacedPoint&) = default;
};

std::array<AxisCell, 3> cells_of(const PointBatch& batch, std::size_t point) {
  return {AxisCell(batch.coordinate(point, 0)), AxisCell(batch.coordinate(point, 1)),
          AxisCell(batch.coordinate(point, 2))};
}

std::vector<PlacedPoint> sorted_by_brick(const PointBatch& batch) {
  std::vector<PlacedPoint> placed(batch.count);
  for (std::size_t point = 0; point < batch.count; ++point) {
    const auto cells = cells_of(batch, point);
    placed[point] = {{cells[0].brick, cells[1].brick, cells[2].brick},
                     static_cast<std::uint32_t>(point)};
  }
  std::sort(placed.begin(), placed.end());
  return placed;
}

// Where each run of points in one brick begins, and the end of the last.
std::vector<std::size_t> run_starts(const std::vector<PlacedPoint>& placed) {
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    if (i == 0 || placed[i].brick != placed[i - 1].brick) starts.push_back(i);
  }
  starts.push_back(placed.size());
  return starts;
}

class FieldFamily : public Family {
 public:
  FieldFamily(Field field, std::uint64_t cache_limit_bytes)
      : field_(std::move(field)),
        channels_(static_cast<std::size_t>(field_.channels())),
        cache_(channels_ * kBrickVoxels * kBrickVoxels * kBrickVoxels, cache_limit_bytes,
               [this](const BrickKey& key, std::span<float> values) {
                 field_.evaluate(brick_box(key), values.data());
               }) {}

  void eval_points(const PointBatch& batch, float* values) const override {
    for (std::size_t begin = 0; begin < batch.count; begin += kSortedPoints) {
      const PointBatch part{batch.origin, batch.points + 3 * begin,
                            std::min(kSortedPoints, batch.count - begin)};
      eval_sorted(part, values + begin * channels_);
    }
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
        field_.evaluate(block, BoxTarget{corner, x_pitch, y_pitch});
      }
    });
  }

  CacheStats cache_stats() const override { return cache_.stats(); }

 private:
  void eval_sorted(const PointBatch& batch, float* values) const {
    const std::vector<PlacedPoint> placed = sorted_by_brick(batch);
    const std::vector<std::size_t> starts = run_starts(placed);
    for_each_part(starts.size() - 1, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t run = begin; run < end; ++run) {
        const auto brick = cache_.get(placed[starts[run]].brick);
        for (std::size_t i = starts[run]; i < starts[run + 1]; ++i) {
          const std::size_t point = placed[i].index;
          interpolate(brick.get(), cells_of(batch, point), channels_, values + point * channels_);
        }
      }
    });
  }

  Field field_;
  std::size_t channels_;
  mutable BrickCache cache_;
};

}  // namespace

std::unique_ptr<Family> make_field_family(Field field, std::uint64_t cache_limit_bytes) {
  return std::make_unique<FieldFamily>(std::move(field), cache_limit_bytes);
}

}  // namespace solidtex::engine
