#include "engine/noise/reference.h"

#include <cmath>

#include "engine/noise/normal.h"

namespace solidtex::engine::reference {

void plane(const StreamKey& key, Distribution distribution, const LatticePoints& points, int count,
           float* values) {
  const auto from_bits =
      distribution == Distribution::normal ? normal_from_bits : uniform_from_bits;
  for (int i = 0; i < count; ++i)
    values[i] = from_bits(solidtex_1_bits(key, points.x, static_cast<std::uint32_t>(points.y[i]),
                                          static_cast<std::uint32_t>(points.z[i])));
}

namespace {

// Normals at the corners (x, y, z) of cell i, z fastest.
struct Corners {
  Corners(const StreamKey& key, const LatticeCells& cells, int i) {
    for (std::uint32_t k = 0; k < 8; ++k) {
      const std::uint32_t step[3] = {k >> 2, k >> 1 & 1, k & 1};
      std::uint32_t at[3];
      for (int axis = 0; axis < 3; ++axis)
        at[axis] = static_cast<std::uint32_t>(cells.corner[axis][i]) + step[axis];
      normal[k] = normal_from_bits(solidtex_1_bits(key, at[0], at[1], at[2]));
    }
  }
  float normal[8];
};

float lerp(float t, float a, float b) { return std::fma(t, b - a, a); }

float trilinear(const StreamKey& key, const LatticeCells& cells, int i) {
  const Corners corners(key, cells, i);
  const auto& normal = corners.normal;
  const auto along_z = [&](int k) { return lerp(cells.fraction[2][i], normal[k], normal[k + 1]); };
  const auto along_y = [&](int k) {
    return lerp(cells.fraction[1][i], along_z(k), along_z(k + 2));
  };
  return lerp(cells.fraction[0][i], along_y(0), along_y(4));
}

// Returns the derivative with respect to a fraction: the difference of values interpolated on the
// other axes.
float step_along(int axis, const StreamKey& key, const LatticeCells& cells, int i) {
  const Corners corners(key, cells, i);
  const auto& normal = corners.normal;
  const auto along = [&](int of, float a, float b) {
    return of == axis ? b - a : lerp(cells.fraction[of][i], a, b);
  };
  const auto along_z = [&](int k) { return along(2, normal[k], normal[k + 1]); };
  const auto along_y = [&](int k) { return along(1, along_z(k), along_z(k + 2)); };
  return along(0, along_y(0), along_y(4));
}

}  // namespace

void trilinear_normal(const StreamKey& key, const LatticeCells& cells, int count, float* values) {
  for (int i = 0; i < count; ++i) values[i] = trilinear(key, cells, i);
}

void trilinear_normal_derivatives(const StreamKey& key, const LatticeCells& cells,
                                  const float* transform, int count, float* values,
                                  float* const* derivatives) {
  for (int i = 0; i < count; ++i) {
    values[i] = trilinear(key, cells, i);
    float step[3];
    for (int axis = 0; axis < 3; ++axis) step[axis] = step_along(axis, key, cells, i);
    for (int k = 0; k < 3; ++k)
      derivatives[k][i] = std::fma(transform[6 + k], step[2],
                                   std::fma(transform[3 + k], step[1], transform[k] * step[0]));
  }
}

void trilinear_normal_of_streams(const StreamKeys& keys, const LatticeCells& cells, int count,
                                 float* values) {
  for (int i = 0; i < count; ++i) {
    const StreamKey key{{keys.word[0][i], keys.word[1][i], keys.word[2][i], keys.word[3][i]}};
    values[i] = trilinear(key, cells, i);
  }
}

}  // namespace solidtex::engine::reference
