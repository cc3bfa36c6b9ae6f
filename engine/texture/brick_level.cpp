#include "engine/texture/brick_level.h"

#include <algorithm>
#include <vector>

#include "engine/texture/brick_lookup.h"
#include "engine/texture/parallel.h"

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

// Where each run of points in one brick begins, and the end of the last.
std::vector<std::size_t> run_starts(const std::vector<PlacedPoint>& placed) {
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    if (i == 0 || placed[i].brick != placed[i - 1].brick) starts.push_back(i);
  }
  starts.push_back(placed.size());
  return starts;
}

}  // namespace

BrickLevel::BrickLevel(const Field& field, const LightChannels& light, BrickGrid grid,
                       std::uint64_t cache_limit_bytes)
    : field_(field),
      light_(light),
      grid_(grid),
      channels_(static_cast<std::size_t>(field.channels())),
      cache_(channels_ * grid.voxel_count(), cache_limit_bytes,
             [this](const BrickKey& key, std::span<float> values) { build(key, values); }) {}

template <class Batch>
void BrickLevel::evaluate(const Batch& batch, std::span<const std::uint32_t> which,
                          const Answers& answers) const {
  const std::vector<PlacedPoint> placed = sorted_by_brick(batch, which, grid_);
  const std::vector<std::size_t> starts = run_starts(placed);
  for_each_part(starts.size() - 1, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t run = begin; run < end; ++run) {
      const auto brick = cache_.get(placed[starts[run]].brick);
      const std::span points(&placed[starts[run]], starts[run + 1] - starts[run]);
      look_up({brick.get(), grid_, channels_}, batch, which, points, answers);
    }
  });
}

template void BrickLevel::evaluate(const PointBatch&, std::span<const std::uint32_t>,
                                   const Answers&) const;
template void BrickLevel::evaluate(const PositionBatch&, std::span<const std::uint32_t>,
                                   const Answers&) const;

void BrickLevel::build(const BrickKey& key, std::span<float> values) const {
  const Box box = grid_.box(key);
  if (grid_.level == 0) return field_.evaluate(box, values.data());
  std::array<std::int64_t, 3> size = {box.size(0), box.size(1), box.size(2)};
  std::vector<float> texels(static_cast<std::size_t>(size[0] * size[1] * size[2]) * channels_);
  field_.evaluate(box, texels.data());
  light_.to_light(texels.data(), texels.size() / channels_);
  for (int level = 0; level < grid_.level; ++level) halve(size, channels_, texels.data());
  std::copy_n(texels.begin(), values.size(), values.begin());
}

void halve(std::array<std::int64_t, 3>& size, std::size_t channels, float* values) {
  const auto step = static_cast<std::ptrdiff_t>(channels);
  const std::ptrdiff_t y_pitch = size[2] * step, x_pitch = size[1] * y_pitch;
  for (std::int64_t& extent : size) extent /= 2;
  float* mean = values;  // never ahead of what is still to be read
  for (std::int64_t x = 0; x < size[0]; ++x)
    for (std::int64_t y = 0; y < size[1]; ++y)
      for (std::int64_t z = 0; z < size[2]; ++z) {
        const float* at = values + 2 * (x * x_pitch + y * y_pitch + z * step);
        for (std::size_t c = 0; c < channels; ++c, ++at) {
          const auto pair = [&](const float* p) { return p[0] + p[step]; };
          const float low = pair(at) + pair(at + y_pitch);
          const float high = pair(at + x_pitch) + pair(at + x_pitch + y_pitch);
          *mean++ = 0.125f * (low + high);
        }
      }
}

}  // namespace solidtex::engine
