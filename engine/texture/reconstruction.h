// Reconstruction of the lattice family between voxel centres, inside one brick: of texels and of
// means over two by cubic convolution, of coarser means linearly.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "engine/field/box.h"
#include "engine/texture/blocks.h"
#include "engine/texture/brick_cache.h"

namespace solidtex::engine {

// How much each of the four voxels around a point counts, t after the second. At a voxel centre it
// is the voxel itself.
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
struct Cubic {
  static constexpr std::size_t kTaps = 4;
  static constexpr float a = -0.75f;
  using Weights = float[kTaps];

  [[gnu::always_inline]] static void weights(float t, Weights& of) {
    of[0] = a * t * std::fma(t, t - 2, 1.0f);
    of[1] = std::fma(t * t, std::fma(a + 2, t, -(a + 3)), 1.0f);
    of[2] = t * std::fma(t, std::fma(-(a + 2), t, 2 * a + 3), -a);
    of[3] = a * t * t * (1 - t);
  }
  // Their change with t.
  [[gnu::always_inline]] static void slopes(float t, Weights& of) {
    of[0] = a * std::fma(t, std::fma(3.0f, t, -4.0f), 1.0f);
    of[1] = t * std::fma(3 * (a + 2), t, -2 * (a + 3));
    of[2] = std::fma(t, std::fma(-3 * (a + 2), t, 2 * (2 * a + 3)), -a);
    of[3] = a * t * std::fma(-3.0f, t, 2.0f);
  }
};

struct Linear {
  static constexpr std::size_t kTaps = 2;
  using Weights = float[kTaps];

  [[gnu::always_inline]] static void weights(float t, Weights& of) { of[0] = 1 - t, of[1] = t; }
  [[gnu::always_inline]] static void slopes(float, Weights& of) { of[0] = -1, of[1] = 1; }
};

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

// Sum over values that are `step` apart, in one order on every machine. Inlined, as all that
// follows, so that it is compiled for the target of its caller.
template <std::size_t kTaps>
[[gnu::always_inline]] inline float weighted(const float (&weights)[kTaps], const float* first,
                                             std::size_t step) {
  float sum = weights[0] * first[0];
  for (std::size_t i = 1; i < kTaps; ++i) sum = std::fma(weights[i], first[i * step], sum);
  return sum;
}

// kChannels neighbouring channels of the voxels around a point. Where there are no others, those of
// the voxels along z are one row.
template <class Kernel, std::size_t kChannels>
struct Cell {
  using Weights = typename Kernel::Weights;
  static constexpr std::size_t kTaps = Kernel::kTaps, kRow = kTaps * kChannels;
  using Row = float[kRow];  // [z][channel], so that compilers take them side by side

  const float* corner;
  std::size_t step_x, step_y, step_z;

  [[gnu::always_inline]] void sum_along_x(const Weights& weights, std::size_t y, Row& sums) const {
    const float* first = corner + y * step_y;
    for (std::size_t i = 0; i < kRow; ++i) {
      const float* lowest = first + i / kChannels * step_z + i % kChannels;
      sums[i] = weighted(weights, lowest, step_x);
    }
  }
  [[gnu::always_inline]] static void sum_along_y(const Weights& weights, const Row (&planes)[kTaps],
                                                 Row& sums) {
    for (std::size_t i = 0; i < kRow; ++i) sums[i] = weighted(weights, &planes[0][i], kRow);
  }

  [[gnu::always_inline]] void interpolate(const std::array<AxisCell, 3>& at, float* values) const {
    Weights x, y, z;
    Kernel::weights(at[0].fraction, x);
    Kernel::weights(at[1].fraction, y);
    Kernel::weights(at[2].fraction, z);
    Row planes[kTaps], row;
    for (std::size_t j = 0; j < kTaps; ++j) sum_along_x(x, j, planes[j]);
    sum_along_y(y, planes, row);
    for (std::size_t c = 0; c < kChannels; ++c) values[c] = weighted(z, row + c, kChannels);
  }

  // The same, and how it changes with the position, [channel][3].
  [[gnu::always_inline]] void interpolate_with_slopes(const std::array<AxisCell, 3>& at,
                                                      float per_texel, float* values,
                                                      float* slopes) const {
    Weights x, y, z, dx, dy, dz;
    Kernel::weights(at[0].fraction, x), Kernel::slopes(at[0].fraction, dx);
    Kernel::weights(at[1].fraction, y), Kernel::slopes(at[1].fraction, dy);
    Kernel::weights(at[2].fraction, z), Kernel::slopes(at[2].fraction, dz);
    Row planes[kTaps], rises[kTaps], row, row_dx, row_dy;
    for (std::size_t j = 0; j < kTaps; ++j) {
      sum_along_x(x, j, planes[j]);
      sum_along_x(dx, j, rises[j]);
    }
    sum_along_y(y, planes, row);
    sum_along_y(y, rises, row_dx);
    sum_along_y(dy, planes, row_dy);
    for (std::size_t c = 0; c < kChannels; ++c) {
      values[c] = weighted(z, row + c, kChannels);
      *slopes++ = per_texel * weighted(z, row_dx + c, kChannels);
      *slopes++ = per_texel * weighted(z, row_dy + c, kChannels);
      *slopes++ = per_texel * weighted(dz, row + c, kChannels);
    }
  }
};

}  // namespace solidtex::engine
