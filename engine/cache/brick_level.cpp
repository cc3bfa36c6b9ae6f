#include "engine/cache/brick_level.h"

#include <algorithm>
#include <vector>

#include "engine/cache/brick_lookup.h"
#include "engine/common/parallel.h"
#include "engine/filter/lattice_fade.h"

namespace solidtex::engine {
namespace {

template <class Batch>
std::vector<PlacedPoint> sorted_by_brick(const Batch& batch, std::span<const std::uint32_t> which,
                                         const BrickGrid& grid) {
  std::vector<PlacedPoint> placed(which.size());
  for (std::size_t i = 0; i < which.size(); ++i) {
    const auto cells = cells_of(batch, which[i], grid);
    placed[i] = {{cells[0].brick, cells[1].brick, cells[2].brick}, static_cast<std::uint32_t>(i)};
  }
  std::sort(placed.begin(), placed.end());
  return placed;
}

// Returns where each run of points in one brick begins, and the end of the last run.
std::vector<std::size_t> run_starts(const std::vector<PlacedPoint>& placed) {
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    if (i == 0 || placed[i].brick != placed[i - 1].brick) starts.push_back(i);
  }
  starts.push_back(placed.size());
  return starts;
}

}  // namespace

BrickLevel::BrickLevel(const Lattice& lattice, const LightChannels& light, BrickGrid grid,
                       std::uint64_t cache_limit_bytes)
    : lattice_(lattice),
      light_(light),
      grid_(grid),
      channels_(static_cast<std::size_t>(lattice.channels())),
      cache_(channels_ * grid.voxel_count(), cache_limit_bytes,
             [this](const BrickKey& key, std::span<float> values) { build(key, values); }) {}

template <class Batch>
void BrickLevel::evaluate(const Batch& batch, std::span<const std::uint32_t> which,
                          const OutputView& output) const {
  const std::vector<PlacedPoint> placed = sorted_by_brick(batch, which, grid_);
  const std::vector<std::size_t> starts = run_starts(placed);
  const ScratchUse scratch(lattice_.scratch(), placed.size() * sizeof(PlacedPoint) +
                                                   starts.size() * sizeof(std::size_t));
  for_each_part(starts.size() - 1, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t run = begin; run < end; ++run) {
      const auto brick = cache_.get(placed[starts[run]].brick);
      const std::span points(&placed[starts[run]], starts[run + 1] - starts[run]);
      look_up({brick.get(), grid_, channels_}, batch, which, points, output);
    }
  });
}

template void BrickLevel::evaluate(const PointBatch&, std::span<const std::uint32_t>,
                                   const OutputView&) const;
template void BrickLevel::evaluate(const PositionBatch&, std::span<const std::uint32_t>,
                                   const OutputView&) const;

void BrickLevel::build(const BrickKey& key, std::span<float> values) const {
  const Box box = grid_.box(key);
  if (grid_.level == 0) return lattice_.evaluate(box, values.data());
  std::array<std::int64_t, 3> size = {box.size(0), box.size(1), box.size(2)};
  std::vector<float> texels(static_cast<std::size_t>(size[0] * size[1] * size[2]) * channels_);
  const ScratchUse scratch(lattice_.scratch(), texels.size() * sizeof(float));
  lattice_.evaluate(box, texels.data());
  light_.to_light(texels.data(), texels.size() / channels_);
  for (int level = 0; level < grid_.level; ++level) halve(size, channels_, texels.data());
  std::copy_n(texels.begin(), values.size(), values.begin());
}

}  // namespace solidtex::engine
