// Checks of the arguments of a query.
#pragma once

#include <cstddef>
#include <cstdint>

#include "engine/common/box.h"
#include "engine/common/points.h"

namespace solidtex::engine {

// Coordinates are meant for |c| <= 2^30; the margin lets a block begin there.
inline constexpr std::int64_t kCoordinateLimit = (std::int64_t{1} << 30) + (1 << 16);

// Throws Error with the first point that is not finite or too far away.
void check_points(const PointBatch& batch, std::size_t channels);

// Throws Error with the first radius that is negative or no number; infinity is a radius.
void check_radii(const float* radii, std::size_t count);

// Throws Error with the first axis that is no number; nine numbers a point, infinity among them.
void check_axes(const float* axes, std::size_t count);

// The box [origin, origin + size); throws Error for a negative size, a box too far away, or one
// with more values than memory can hold.
Box checked_box(const std::int64_t origin[3], const std::int64_t size[3], std::size_t channels);

}  // namespace solidtex::engine
