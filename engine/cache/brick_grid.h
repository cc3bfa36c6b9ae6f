// The lattice of bricks of one level: which voxels a brick holds, and where a point lies in it.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "engine/cache/brick_cache.h"
#include "engine/common/box.h"
#include "engine/filter/reconstruction.h"

namespace solidtex::engine {

// Bricks of voxels of one size, 2^level texels wide. A brick answers for the points whose first
// voxels are its first edge^3, and holds those that they take part of as well: every point needs
// exactly one brick. Brick corners are multiples of the edge, where the network's tiles begin: from
// one voxel earlier on 19^3 voxels take 1.3 times as long.
//
// Coarse levels are interpolated linearly: a cubic margin of their voxels is wide. Processor time
// of scenes/carved.json at a small size, beside linear interpolation of all levels: all cubic 1.6,
// the first two 1.16, the first alone 1.05, but then contrast drops where the second takes over
// (tests/scenes/test_zoom.cpp). Footprints miss true means by as much either way.
struct BrickGrid {
  int level = 0;
  int log_edge = 4;  // edges are powers of two, so that points are placed without divisions
  double voxels_per_texel = 1 / static_cast<double>(1 << level);

  std::int64_t edge() const { return std::int64_t{1} << log_edge; }
  bool is_cubic() const { return level <= 1; }
  // Voxels of an axis that a point takes part of.
  std::int64_t taps() const { return is_cubic() ? Cubic::kTaps : Linear::kTaps; }
  std::int64_t voxels() const { return edge() + taps() - 1; }
  std::size_t voxel_count() const {
    const auto side = static_cast<std::size_t>(voxels());
    return side * side * side;
  }
  // The texels that a brick's voxels cover.
  Box box(const BrickKey& key) const {
    Box box;
    box.lo = {std::int64_t{key.x} << log_edge << level, std::int64_t{key.y} << log_edge << level,
              std::int64_t{key.z} << log_edge << level};
    for (int axis = 0; axis < 3; ++axis) box.hi[axis] = box.lo[axis] + (voxels() << level);
    return box;
  }
};

// Where a coordinate lies among the voxel centres of its axis: between the middle two of those that
// it takes part of, of which `voxel` is the first, after the lower one by `fraction`.
struct AxisCell {
  std::int32_t brick, voxel;  // voxel relative to the brick
  float fraction;

  AxisCell(double coordinate, const BrickGrid& grid) {
    const double from_centre = coordinate * grid.voxels_per_texel - 0.5;
    const double cell = std::floor(from_centre);
    fraction = static_cast<float>(from_centre - cell);
    const auto index = static_cast<std::int64_t>(cell) - (grid.taps() / 2 - 1);
    brick = static_cast<std::int32_t>(index >> grid.log_edge);
    voxel = static_cast<std::int32_t>(index & (grid.edge() - 1));
  }
};

}  // namespace solidtex::engine
