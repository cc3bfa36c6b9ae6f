// Parity split of a transposed convolution: stride 2 makes eight plain convolutions, one for each
// parity of the output.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "engine/kernels/reference.h"

namespace solidtex::engine {

// The outputs first + 2 (i, j, k) and the taps that reach them. Term t of output (i, j, k) reads
// input[i * plane_pitch + j * row_pitch + k + offsets[t]].
struct ParityClass {
  std::array<std::int64_t, 3> first{}, count{};
  LinearLayer layer;
  const float* input = nullptr;
  std::vector<std::ptrdiff_t> offsets;
};

// Returns the classes that have outputs.
std::vector<ParityClass> split_by_parity(const LinearLayer& layer, const TransposedShape& shape,
                                         const ConstVolume& in, const Volume& out);

}  // namespace solidtex::engine
