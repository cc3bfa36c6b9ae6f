// Planes and lookups of the scheme solidtex-1 as plain loops: the definition of correct.
#pragma once

#include <cstdint>

#include "engine/model/model.h"
#include "engine/noise/hash.h"

namespace solidtex::engine {

// Lattice points of one plane: (x, y[i], z[i]), modulo 2^32. Readable to a multiple of 16 points,
// whatever the count.
struct LatticePoints {
  std::uint32_t x;
  const std::int32_t *y, *z;
};

// Where points fall on a lattice, planar: the lower corner of the cell (modulo 2^32) and the
// fractions in [0, 1]. Readable to a multiple of 16 points, whatever the count.
struct LatticeCells {
  const std::int32_t* corner[3];
  const float* fraction[3];
};

// Keys of streams, planar; readable to a multiple of 16 streams.
struct StreamKeys {
  const std::uint32_t* word[4];
};

namespace reference {

// values[i] = the value at point i.
void plane(const StreamKey& key, Distribution distribution, const LatticePoints& points, int count,
           float* values);

// values[i] = normal noise interpolated at point i, along z, then y, then x; one lerp is
// fma(t, b - a, a).
void trilinear_normal(const StreamKey& key, const LatticeCells& cells, int count, float* values);

// The same, and how it changes: derivatives[axis][i] = its derivative by a coordinate of the
// position that `transform` (3 x 3, row-major) takes to the lattice; on the faces of a cell that on
// the upper side. Those by the fractions are differences of what is interpolated, in the same
// order, and one derivative is fma(t2, d2, fma(t1, d1, t0 * d0)).
void trilinear_normal_derivatives(const StreamKey& key, const LatticeCells& cells,
                                  const float* transform, int count, float* values,
                                  float* const* derivatives);

// The same as trilinear_normal where each lookup i has a stream of its own.
void trilinear_normal_of_streams(const StreamKeys& keys, const LatticeCells& cells, int count,
                                 float* values);

}  // namespace reference
}  // namespace solidtex::engine
