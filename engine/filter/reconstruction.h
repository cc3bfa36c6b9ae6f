// Reconstruction of a lattice between voxel centers: cubic convolution or linear.
#pragma once

#include <cmath>
#include <cstddef>

namespace solidtex::engine {

// Weights of the four voxels around a point at `t` after the second voxel. At a voxel center the
// result is the voxel.
//
// Keys, "Cubic convolution interpolation for digital image processing" (1981), equation 8, with the
// parameter a of equation 6. a = -1/2 reproduces parabolas exactly; a = -3/4 keeps more fine grain
// on slices at any angle. docs/experiments/engine-constants.md compares kernels.
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
  // Derivatives of the weights with respect to t.
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

// Sums values that are `step` apart, in one order on every machine. Inlined, like all that follows,
// so that it is compiled for the caller's target.
template <std::size_t kTaps>
[[gnu::always_inline]] inline float weighted(const float (&weights)[kTaps], const float* first,
                                             std::size_t step) {
  float sum = weights[0] * first[0];
  for (std::size_t i = 1; i < kTaps; ++i) sum = std::fma(weights[i], first[i * step], sum);
  return sum;
}

// kChannels neighboring channels of the voxels around a point. If these are all channels, voxels
// along z form one contiguous row.
template <class Kernel, std::size_t kChannels>
struct Cell {
  using Weights = typename Kernel::Weights;
  static constexpr std::size_t kTaps = Kernel::kTaps, kRow = kTaps * kChannels;
  using Row = float[kRow];  // [z][channel], for vectorization

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

  // at[axis].fraction is the position between the middle two voxels, from 0 to 1.
  template <class AxisCells>
  [[gnu::always_inline]] void interpolate(const AxisCells& at, float* values) const {
    Weights x, y, z;
    Kernel::weights(at[0].fraction, x);
    Kernel::weights(at[1].fraction, y);
    Kernel::weights(at[2].fraction, z);
    Row planes[kTaps], row;
    for (std::size_t j = 0; j < kTaps; ++j) sum_along_x(x, j, planes[j]);
    sum_along_y(y, planes, row);
    for (std::size_t c = 0; c < kChannels; ++c) values[c] = weighted(z, row + c, kChannels);
  }

  // Interpolates values and their derivatives, [channel][3].
  template <class AxisCells>
  [[gnu::always_inline]] void interpolate_with_derivatives(const AxisCells& at, float per_texel,
                                                           float* values,
                                                           float* derivatives) const {
    Weights x, y, z, dx, dy, dz;
    Kernel::weights(at[0].fraction, x), Kernel::derivatives(at[0].fraction, dx);
    Kernel::weights(at[1].fraction, y), Kernel::derivatives(at[1].fraction, dy);
    Kernel::weights(at[2].fraction, z), Kernel::derivatives(at[2].fraction, dz);
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
