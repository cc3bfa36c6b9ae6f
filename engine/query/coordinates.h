// Checks of a query's arguments.
#pragma once

#include <cstddef>
#include <cstdint>

#include "engine/common/box.h"
#include "engine/common/points.h"

namespace solidtex::engine {

// Largest magnitude of a coordinate. The margin beyond 2^30 is room for a block.
inline constexpr std::int64_t kCoordinateLimit = (std::int64_t{1} << 30) + (1 << 16);

// Throws Error that names the first point that is not finite or too far away.
void check_points(const PointBatch& batch, std::size_t channels);

// Throws Error that names the first radius that is negative or NaN. Infinity is valid.
void check_radii(const float* radii, std::size_t count);

// Throws Error that names the first axis with a NaN. Infinity is valid.
void check_axes(const float* axes, std::size_t count);

// Returns the box [origin, origin + size). Throws Error for a negative size, a box that is too far
// away, or more values than memory can hold.
Box checked_box(const std::int64_t origin[3], const std::int64_t size[3], std::size_t channels);

}  // namespace solidtex::engine
