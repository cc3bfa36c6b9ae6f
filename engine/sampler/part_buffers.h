// Working memory of a part of a batch: a block of points, or one point.
#pragma once

#include <hwy/aligned_allocator.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <new>

#include "engine/kernels/kernels.h"
#include "engine/sampler/octave.h"
#include "engine/sampler/octave_fade.h"

namespace solidtex::engine {

// Positions of points and their cells in one octave.
struct Lookup {
  PlanarPositions positions;
  OctaveCells cells;
};

// Planar buffers. An activation buffer has the rows of a layer's input: units of the previous
// layer, then octaves. Each row has three derivatives: for a block in the same row, for one point
// in three buffers of their own, so that neighboring units are contiguous.
struct PartBuffers {
  PartBuffers(std::size_t rows, std::size_t count, bool with_derivatives_)
      : is_point(count == 1),
        with_derivatives(with_derivatives_),
        pitch(is_point ? 1 : kOctaveBlock),
        axis_pitch(is_point ? rows : rounded_up(count)),
        row_pitch(is_point ? 1 : 3 * axis_pitch) {
    const std::size_t values = rows * pitch;
    const std::size_t derivative_count =
        with_derivatives ? 3 * rows * (is_point ? 1 : axis_pitch) : 0;
    storage = hwy::AllocateAligned<float>(2 * (values + derivative_count));
    if (!storage) throw std::bad_alloc();
    current = storage.get();
    next = current + values;
    derivatives = next + values;
    next_derivatives = derivatives + derivative_count;
  }
  static std::size_t rounded_up(std::size_t count) {
    constexpr std::size_t kStep = kernels::kPointStep;
    return (std::min<std::size_t>(count, kOctaveBlock) + kStep - 1) / kStep * kStep;
  }
  float* values_of(int row) const { return current + static_cast<std::size_t>(row) * pitch; }
  std::array<float*, 3> derivatives_of(int row) const {
    float* first = derivatives + static_cast<std::size_t>(row) * row_pitch;
    return {first, first + axis_pitch, first + 2 * axis_pitch};
  }

  bool is_point, with_derivatives;
  std::size_t pitch, axis_pitch, row_pitch;
  hwy::AlignedFreeUniquePtr<float[]> storage;
  float *current, *next, *derivatives, *next_derivatives;
  Lookup lookup;
  PlanarSpreads footprints;
};

}  // namespace solidtex::engine
