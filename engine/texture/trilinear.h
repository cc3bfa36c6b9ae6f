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

// A brick answers for the points between 16^3 voxel centres and their upper neighbours, and so
// holds 17^3 voxels: every point needs exactly one brick.
inline constexpr std::int32_t kBrickEdge = 16;
inline constexpr std::int32_t kBrickVoxels = kBrickEdge + 1;

inline Box brick_box(const BrickKey& key) {
  Box box;
  box.lo = {std::int64_t{key.x} * kBrickEdge, std::int64_t{key.y} * kBrickEdge,
            std::int64_t{key.z} * kBrickEdge};
  for (int axis = 0; axis < 3; ++axis) box.hi[axis] = box.lo[axis] + kBrickVoxels;
  return box;
}

// Where a coordinate lies among the voxel centres of its axis: after `voxel` by `fraction`.
struct AxisCell {
  std::int32_t brick, voxel;  // voxel relative to the brick
  float fraction;

  explicit AxisCell(double coordinate) {
    const double from_centre = coordinate - 0.5;
    const double cell = std::floor(from_centre);
    fraction = static_cast<float>(from_centre - cell);
    const auto index = static_cast<std::int64_t>(cell);
    brick = static_cast<std::int32_t>(floor_div(index, kBrickEdge));
    voxel = static_cast<std::int32_t>(index - std::int64_t{brick} * kBrickEdge);
  }
};

inline float lerp(float t, float a, float b) { return std::fma(t, b - a, a); }

// One point from a brick's values, [x][y][z][channel]; the axes in the order z, y, x.
inline void interpolate(const float* brick, const std::array<AxisCell, 3>& cell,
                        std::size_t channels, float* values) {
  const std::size_t step_z = channels, step_y = kBrickVoxels * step_z,
                    step_x = kBrickVoxels * step_y;
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

}  // namespace solidtex::engine
