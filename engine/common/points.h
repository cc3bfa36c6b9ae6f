// Points of a query, as the caller gave them or as positions in texels.
#pragma once

#include <array>
#include <cstddef>

namespace solidtex::engine {

// Points of one query, as the caller gave them.
struct PointBatch {
  std::array<double, 3> origin{};
  const float* points = nullptr;
  std::size_t count = 0;

  double coordinate(std::size_t point, int axis) const {
    return origin[axis] + static_cast<double>(points[3 * point + axis]);
  }
};

// Footprints of the points of one query: a radius per point, three axes per point, or neither.
struct Footprints {
  const float* radii = nullptr;  // [point]
  const float* axes = nullptr;   // [point][3][3]
};

// Positions in texels, as (x, y, z).
struct PositionBatch {
  const double* positions = nullptr;
  std::size_t count = 0;

  double coordinate(std::size_t point, int axis) const { return positions[3 * point + axis]; }
};

}  // namespace solidtex::engine
