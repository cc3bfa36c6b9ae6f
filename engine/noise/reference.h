// Scheme solidtex-1 as plain loops: the definition of correct.
#pragma once

#include <cstdint>

#include "engine/model/model.h"
#include "engine/noise/hash.h"

namespace solidtex::engine {

// Lattice points of one plane: (x, y[i], z[i]) modulo 2^32. Arrays are readable up to a multiple of
// 16 points.
struct LatticePoints {
  std::uint32_t x;
  const std::int32_t *y, *z;
};

// Cells that contain points, planar: lower corner modulo 2^32 and fraction in [0, 1]. Arrays are
// readable up to a multiple of 16 points.
struct LatticeCells {
  const std::int32_t* corner[3];
  const float* fraction[3];
};

// Keys of streams, planar. Arrays are readable up to a multiple of 16 streams.
struct StreamKeys {
  const std::uint32_t* word[4];
};

namespace reference {

// values[i] = value at point i.
void plane(const StreamKey& key, Distribution distribution, const LatticePoints& points, int count,
           float* values);

// values[i] = normal noise interpolated at point i along z, then y, then x. One interpolation is
// fma(t, b - a, a).
void trilinear_normal(const StreamKey& key, const LatticeCells& cells, int count, float* values);

// Writes values and derivatives[axis][i], the derivative with respect to a coordinate of the
// position. `transform` (3 x 3, row-major) maps positions to the lattice. On a face between cells
// the derivative is that of the upper cell. Derivatives with respect to fractions are differences
// of interpolated values in the same order; a derivative is fma(t2, d2, fma(t1, d1, t0 * d0)).
void trilinear_normal_derivatives(const StreamKey& key, const LatticeCells& cells,
                                  const float* transform, int count, float* values,
                                  float* const* derivatives);

// As trilinear_normal, but lookup i has the stream keys[i].
void trilinear_normal_of_streams(const StreamKeys& keys, const LatticeCells& cells, int count,
                                 float* values);

}  // namespace reference
}  // namespace solidtex::engine
