// Reconstruction of points inside one brick.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/cache/brick_grid.h"
#include "engine/common/output_view.h"
#include "engine/common/points.h"

namespace solidtex::engine {

// Point and the brick that it needs.
struct PlacedPoint {
  BrickKey brick;
  std::uint32_t place;  // index into `which`
  friend auto operator<=>(const PlacedPoint&, const PlacedPoint&) = default;
};

template <class Batch>
[[gnu::always_inline]] inline std::array<AxisCell, 3> cells_of(const Batch& batch,
                                                               std::size_t point,
                                                               const BrickGrid& grid) {
  return {AxisCell(batch.coordinate(point, 0), grid), AxisCell(batch.coordinate(point, 1), grid),
          AxisCell(batch.coordinate(point, 2), grid)};
}

struct Brick {
  const float* values;
  BrickGrid grid;
  std::size_t channels;
};

// Evaluates points of a batch that lie in the brick: batch[which[place]] into output `place`.
void look_up(const Brick& brick, const PointBatch& batch, std::span<const std::uint32_t> which,
             std::span<const PlacedPoint> points, const OutputView& output);
void look_up(const Brick& brick, const PositionBatch& batch, std::span<const std::uint32_t> which,
             std::span<const PlacedPoint> points, const OutputView& output);

}  // namespace solidtex::engine
