// Trilinear reconstruction of the lattice family between voxel centres, inside one brick.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "engine/field/box.h"
#include "engine/texture/blocks.h"
#include "engine/texture/brick_cache.h"

namespace solidtex::engine {

// Bricks of voxels of one size, 2^level texels wide. A brick answers for the points between edge^3
// voxel centres and their upper neighbours, and so holds (edge + 1)^3 voxels: every point needs
// exactly one brick.
struct BrickGrid {
  int level = 0;
  int log_edge = 4;  // edges are powers of two, so that points are placed without divisions
  double voxels_per_texel = 1 / static_cast<double>(1 << level);

  std::int64_t edge() const { return std::int64_t{1} << log_edge; }
  std::int64_t voxels() const { return edge() + 1; }
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

// Where a coordinate lies among the voxel centres of its axis: after `voxel` by `fraction`.
struct AxisCell {
  std::int32_t brick, voxel;  // voxel relative to the brick
  float fraction;

  AxisCell(double coordinate, const BrickGrid& grid) {
    const double from_centre = coordinate * grid.voxels_per_texel - 0.5;
    const double cell = std::floor(from_centre);
    fraction = static_cast<float>(from_centre - cell);
    const auto index = static_cast<std::int64_t>(cell);
    brick = static_cast<std::int32_t>(index >> grid.log_edge);
    voxel = static_cast<std::int32_t>(index & (grid.edge() - 1));
  }
};

inline float lerp(float t, float a, float b) { return std::fma(t, b - a, a); }

// One point from a brick's values, [x][y][z][channel]; the axes in the order z, y, x.
inline void interpolate(const float* brick, const BrickGrid& grid,
                        const std::array<AxisCell, 3>& cell, std::size_t channels, float* values) {
  const auto voxels = static_cast<std::size_t>(grid.voxels());
  const std::size_t step_z = channels, step_y = voxels * step_z, step_x = voxels * step_y;
  const float* corner =
      brick + cell[0].voxel * step_x + cell[1].voxel * step_y + cell[2].voxel * step_z;
  const auto along_z = [&](const float* at) { return lerp(cell[2].fraction, at[0], at[step_z]); };
  const auto along_y = [&](const float* at) {
    return lerp(cell[1].fraction, along_z(at), along_z(at + step_y));
  };
  for (std::size_t channel = 0; channel < channels; ++channel, ++corner) {
    values[channel] = lerp(cell[0].fraction, along_y(corner), along_y(corner + step_x));
  }
}

// The same, and how it changes with the position, [channel][3].
inline void interpolate_with_slopes(const float* brick, const BrickGrid& grid,
                                    const std::array<AxisCell, 3>& cell, std::size_t channels,
                                    float* values, float* slopes) {
  const auto voxels = static_cast<std::size_t>(grid.voxels());
  const std::size_t step_z = channels, step_y = voxels * step_z, step_x = voxels * step_y;
  const float* corner =
      brick + cell[0].voxel * step_x + cell[1].voxel * step_y + cell[2].voxel * step_z;
  const float x = cell[0].fraction, y = cell[1].fraction, z = cell[2].fraction;
  const auto per_texel = static_cast<float>(grid.voxels_per_texel);
  const auto rise = [&](const float* at) { return at[step_z] - at[0]; };
  const auto along_z = [&](const float* at) { return lerp(z, at[0], at[step_z]); };
  for (std::size_t channel = 0; channel < channels; ++channel, ++corner) {
    const float* upper = corner + step_x;
    const float low = along_z(corner), low_y = along_z(corner + step_y);
    const float high = along_z(upper), high_y = along_z(upper + step_y);
    const float low_rise = lerp(y, rise(corner), rise(corner + step_y));
    const float high_rise = lerp(y, rise(upper), rise(upper + step_y));
    const float low_value = lerp(y, low, low_y), high_value = lerp(y, high, high_y);
    values[channel] = lerp(x, low_value, high_value);
    *slopes++ = per_texel * (high_value - low_value);
    *slopes++ = per_texel * lerp(x, low_y - low, high_y - high);
    *slopes++ = per_texel * lerp(x, low_rise, high_rise);
  }
}

}  // namespace solidtex::engine
