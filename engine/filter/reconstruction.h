// Reconstruction of the lattice family between voxel centres, inside one brick: of texels and of
// means over two by cubic convolution, of coarser means linearly.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

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
  [[gnu::always_inline]] static void derivatives(float t, Weights& of) {
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
  [[gnu::always_inline]] static void derivatives(float, Weights& of) { of[0] = -1, of[1] = 1; }
};

// Where a point lies among the voxel centres around it, along each axis, from 0 to 1.
using Fractions = std::array<float, 3>;

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

  [[gnu::always_inline]] void interpolate(const Fractions& at, float* values) const {
    Weights x, y, z;
    Kernel::weights(at[0], x);
    Kernel::weights(at[1], y);
    Kernel::weights(at[2], z);
    Row planes[kTaps], row;
    for (std::size_t j = 0; j < kTaps; ++j) sum_along_x(x, j, planes[j]);
    sum_along_y(y, planes, row);
    for (std::size_t c = 0; c < kChannels; ++c) values[c] = weighted(z, row + c, kChannels);
  }

  // The same, and how it changes with the position, [channel][3].
  [[gnu::always_inline]] void interpolate_with_derivatives(const Fractions& at, float per_texel,
                                                           float* values,
                                                           float* derivatives) const {
    Weights x, y, z, dx, dy, dz;
    Kernel::weights(at[0], x), Kernel::derivatives(at[0], dx);
    Kernel::weights(at[1], y), Kernel::derivatives(at[1], dy);
    Kernel::weights(at[2], z), Kernel::derivatives(at[2], dz);
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
      *derivatives++ = per_texel * weighted(z, row_dx + c, kChannels);
      *derivatives++ = per_texel * weighted(z, row_dy + c, kChannels);
      *derivatives++ = per_texel * weighted(dz, row + c, kChannels);
    }
  }
};

}  // namespace solidtex::engine
