// Reconstruction of the lattice family between voxel centres, inside one brick: cubic convolution.
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
// voxel centres and their upper neighbours. Each takes part of the next ones on both sides as well,
// so that it holds (edge + 3)^3 voxels, and every point needs exactly one brick.
struct BrickGrid {
  int level = 0;
  int log_edge = 4;  // edges are powers of two, so that points are placed without divisions
  double voxels_per_texel = 1 / static_cast<double>(1 << level);

  std::int64_t edge() const { return std::int64_t{1} << log_edge; }
  std::int64_t voxels() const { return edge() + 3; }
  std::size_t voxel_count() const {
    const auto side = static_cast<std::size_t>(voxels());
    return side * side * side;
  }
  // The texels that a brick's voxels cover.
  Box box(const BrickKey& key) const {
    const auto first = [&](std::int32_t brick) {
      return ((std::int64_t{brick} << log_edge) - 1) << level;
    };
    Box box;
    box.lo = {first(key.x), first(key.y), first(key.z)};
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

// How much each of the four voxels around a point counts: the one before `voxel`, it, and the two
// after it. At a voxel centre it is the voxel itself.
//
// Keys, "Cubic convolution interpolation for digital image processing" (1981), equation 8 with a of
// his equation 6 free. His a = -1/2 follows straight lines and parabolas exactly, -3/4 keeps more
// of the fine grain that makes a slice look like its photograph. Patterns of slices at any angle,
// as multiples of the photograph's own (solidtex-eval), and what slices along the axes have:
//
//                    trilinear   -1/2   -0.6   -3/4   along axes
//     grey granite        2.93   1.81   1.68   1.51         1.26
//     rust                2.44   1.54      -   1.31         1.23
//     brick               4.09   2.24      -   1.74         1.41
//
// Kernels of six voxels an axis take 3.4 times as many values (grey granite: Keys's of fourth order
// 1.59, Lanczos's 1.33), the cubic B-spline through all voxels (1.43) needs all of them.
struct CubicWeights {
  static constexpr float kA = -0.75f;

  float value[4];

  [[gnu::always_inline]] explicit CubicWeights(float t) {
    value[0] = kA * t * std::fma(t, t - 2, 1.0f);
    value[1] = std::fma(t * t, std::fma(kA + 2, t, -(kA + 3)), 1.0f);
    value[2] = t * std::fma(t, std::fma(-(kA + 2), t, 2 * kA + 3), -kA);
    value[3] = kA * t * t * (1 - t);
  }
};

// Their change with t.
struct CubicSlopes {
  float value[4];

  [[gnu::always_inline]] explicit CubicSlopes(float t) {
    constexpr float a = CubicWeights::kA;
    value[0] = a * std::fma(t, std::fma(3.0f, t, -4.0f), 1.0f);
    value[1] = t * std::fma(3 * (a + 2), t, -2 * (a + 3));
    value[2] = std::fma(t, std::fma(-3 * (a + 2), t, 2 * (2 * a + 3)), -a);
    value[3] = a * t * std::fma(-3.0f, t, 2.0f);
  }
};

// Sum over four values, `step` apart, in one order on every machine. Inlined, as all that follows,
// so that it is compiled for the target of its caller.
[[gnu::always_inline]] inline float weighted(const float (&weights)[4], const float* first,
                                             std::size_t step) {
  float sum = weights[0] * first[0];
  for (std::size_t i = 1; i < 4; ++i) sum = std::fma(weights[i], first[i * step], sum);
  return sum;
}

// kChannels neighbouring channels of the 4^3 voxels around a point. Where there are no others,
// those of four voxels along z are one row.
template <std::size_t kChannels>
struct Cell {
  static constexpr std::size_t kRow = 4 * kChannels;
  using Row = float[kRow];  // [z][channel], so that compilers take them side by side

  const float* corner;
  std::size_t step_x, step_y, step_z;

  [[gnu::always_inline]] inline void sum_along_x(const float (&weights)[4], std::size_t y,
                                                 Row& sums) const {
    const float* first = corner + y * step_y;
    for (std::size_t i = 0; i < kRow; ++i) {
      const float* lowest = first + i / kChannels * step_z + i % kChannels;
      sums[i] = weighted(weights, lowest, step_x);
    }
  }
};

template <std::size_t kRow>
[[gnu::always_inline]] inline void sum_along_y(const float (&weights)[4],
                                               const float (&planes)[4][kRow],
                                               float (&sums)[kRow]) {
  for (std::size_t i = 0; i < kRow; ++i) sums[i] = weighted(weights, &planes[0][i], kRow);
}

template <std::size_t kChannels>
[[gnu::always_inline]] inline void interpolate(const Cell<kChannels>& cell,
                                               const std::array<AxisCell, 3>& at, float* values) {
  const CubicWeights x(at[0].fraction), y(at[1].fraction), z(at[2].fraction);
  float planes[4][4 * kChannels], row[4 * kChannels];
  for (std::size_t j = 0; j < 4; ++j) cell.sum_along_x(x.value, j, planes[j]);
  sum_along_y(y.value, planes, row);
  for (std::size_t c = 0; c < kChannels; ++c) values[c] = weighted(z.value, row + c, kChannels);
}

// The same, and how it changes with the position, [channel][3].
template <std::size_t kChannels>
[[gnu::always_inline]] inline void interpolate_with_slopes(const Cell<kChannels>& cell,
                                                           const std::array<AxisCell, 3>& at,
                                                           float per_texel, float* values,
                                                           float* slopes) {
  const CubicWeights x(at[0].fraction), y(at[1].fraction), z(at[2].fraction);
  const CubicSlopes dx(at[0].fraction), dy(at[1].fraction), dz(at[2].fraction);
  float planes[4][4 * kChannels], rises[4][4 * kChannels];
  for (std::size_t j = 0; j < 4; ++j) {
    cell.sum_along_x(x.value, j, planes[j]);
    cell.sum_along_x(dx.value, j, rises[j]);
  }
  float row[4 * kChannels], row_dx[4 * kChannels], row_dy[4 * kChannels];
  sum_along_y(y.value, planes, row);
  sum_along_y(y.value, rises, row_dx);
  sum_along_y(dy.value, planes, row_dy);
  for (std::size_t c = 0; c < kChannels; ++c) {
    values[c] = weighted(z.value, row + c, kChannels);
    *slopes++ = per_texel * weighted(z.value, row_dx + c, kChannels);
    *slopes++ = per_texel * weighted(z.value, row_dy + c, kChannels);
    *slopes++ = per_texel * weighted(dz.value, row + c, kChannels);
  }
}

}  // namespace solidtex::engine
