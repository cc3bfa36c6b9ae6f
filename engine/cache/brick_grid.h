// Grid of bricks of one level: the voxels of a brick and the cell of a point.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "engine/cache/brick_cache.h"
#include "engine/common/box.h"
#include "engine/filter/reconstruction.h"

namespace solidtex::engine {

// Bricks of one level, whose voxels are 2^level texels wide. A point belongs to the brick that
// holds the first voxel of its cell; a brick also stores the margin that those cells reach. So
// every point needs exactly one brick. Brick corners are multiples of the edge, where tiles of the
// network begin.
//
// Levels 0 and 1 use cubic reconstruction. Coarser levels are linear, because a cubic margin of
// their voxels is wide. docs/experiments/engine-constants.md compares the costs.
struct BrickGrid {
  int level = 0;
  int log_edge = 4;  // a power of two: points are placed by shifts
  double voxels_per_texel = 1 / static_cast<double>(1 << level);

  std::int64_t edge() const { return std::int64_t{1} << log_edge; }
  bool is_cubic() const { return level <= 1; }
  // Voxels along one axis of a cell.
  std::int64_t taps() const {
    return static_cast<std::int64_t>(is_cubic() ? Cubic::kTaps : Linear::kTaps);
  }
  std::int64_t voxels() const { return edge() + taps() - 1; }
  std::size_t voxel_count() const {
    const auto side = static_cast<std::size_t>(voxels());
    return side * side * side;
  }
  // Returns the texels that a brick covers with its margin.
  Box box(const BrickKey& key) const {
    Box box;
    box.lo = {std::int64_t{key.x} << log_edge << level, std::int64_t{key.y} << log_edge << level,
              std::int64_t{key.z} << log_edge << level};
    for (int axis = 0; axis < 3; ++axis) box.hi[axis] = box.lo[axis] + (voxels() << level);
    return box;
  }
};

// Cell of a coordinate on one axis: its brick, its first voxel, and the position between the middle
// two voxel centers.
struct AxisCell {
  std::int32_t brick, voxel;  // the voxel is relative to the brick
  float fraction;

  AxisCell(double coordinate, const BrickGrid& grid) {
    const double from_center = coordinate * grid.voxels_per_texel - 0.5;
    const double cell = std::floor(from_center);
    fraction = static_cast<float>(from_center - cell);
    const auto index = static_cast<std::int64_t>(cell) - (grid.taps() / 2 - 1);
    brick = static_cast<std::int32_t>(index >> grid.log_edge);
    voxel = static_cast<std::int32_t>(index & (grid.edge() - 1));
  }
};

}  // namespace solidtex::engine
