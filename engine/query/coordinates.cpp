#include "engine/query/coordinates.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "engine/common/error.h"

namespace solidtex::engine {
namespace {

constexpr char kAxisNames[] = "xyz";
constexpr std::size_t kMaxValues = std::numeric_limits<std::ptrdiff_t>::max() / sizeof(float);

template <class... Parts>
[[noreturn]] void refuse(const Parts&... parts) {
  std::ostringstream message;
  message.precision(std::numeric_limits<double>::max_digits10);
  (message << ... << parts);
  throw Error(SOLIDTEX_INVALID_ARGUMENT, message.str());
}

bool in_range(double coordinate) {  // false for NaN
  return std::abs(coordinate) <= static_cast<double>(kCoordinateLimit);
}

bool point_in_range(const PointBatch& batch, std::size_t point) {
  return in_range(batch.coordinate(point, 0)) && in_range(batch.coordinate(point, 1)) &&
         in_range(batch.coordinate(point, 2));
}

std::size_t first_bad_point(const PointBatch& batch) {
  std::size_t point = 0;
  while (point < batch.count && point_in_range(batch, point)) ++point;
  return point;
}

}  // namespace

void check_points(const PointBatch& batch, std::size_t channels) {
  if (batch.count > kMaxValues / std::max<std::size_t>(channels, 3)) {
    refuse("count is ", batch.count, ": more points than memory can hold");
  }
  const std::size_t bad = first_bad_point(batch);
  if (bad == batch.count) return;
  int axis = 0;
  while (in_range(batch.coordinate(bad, axis))) ++axis;
  refuse("point ", bad, ": ", kAxisNames[axis], " is ", batch.coordinate(bad, axis), " (origin ",
         batch.origin[axis], " + point ", batch.points[3 * bad + axis],
         "), expected a finite coordinate within +-", kCoordinateLimit);
}

void check_radii(const float* radii, std::size_t count) {
  for (std::size_t point = 0; point < count; ++point) {
    if (!(radii[point] >= 0)) {
      refuse("radius of point ", point, " is ", radii[point], ", expected 0 or more");
    }
  }
}

void check_axes(const float* axes, std::size_t count) {
  for (std::size_t i = 0; i < 9 * count; ++i) {
    if (std::isnan(axes[i])) {
      refuse("axis ", i % 9 / 3, " of point ", i / 9, ": ", kAxisNames[i % 3],
             " is no number, expected one or infinity");
    }
  }
}

Box checked_box(const std::int64_t origin[3], const std::int64_t size[3], std::size_t channels) {
  for (int axis = 0; axis < 3; ++axis) {
    if (size[axis] < 0) {
      refuse("box size along ", kAxisNames[axis], " is ", size[axis], ", expected 0 or more");
    }
    // Written without origin + size, which could overflow.
    if (origin[axis] < -kCoordinateLimit || origin[axis] > kCoordinateLimit ||
        size[axis] > kCoordinateLimit - origin[axis]) {
      refuse("box along ", kAxisNames[axis], " has origin ", origin[axis], " and size ", size[axis],
             ", expected voxels within +-", kCoordinateLimit);
    }
  }
  Box box;
  std::size_t values = channels;
  for (int axis = 0; axis < 3; ++axis) {
    box.lo[axis] = origin[axis];
    box.hi[axis] = origin[axis] + size[axis];
  }
  if (box.empty()) return box;
  for (int axis = 0; axis < 3; ++axis) {
    if (values > kMaxValues / static_cast<std::size_t>(size[axis])) {
      refuse("box of ", size[0], " x ", size[1], " x ", size[2], " x ", channels,
             " values: more than memory can hold");
    }
    values *= static_cast<std::size_t>(size[axis]);
  }
  return box;
}

}  // namespace solidtex::engine
