// Triangulation of polygons.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace solidtex::mesh {

// Appends triangles of indices into `corners`, with the orientation of the polygon. The polygon may
// be concave and slightly bent. Every corner is used, which keeps closed surfaces closed; a simple
// polygon gives no degenerate triangles. Repeated corners are skipped; fewer than three distinct
// corners give no triangle.
//
// A concave polygon takes up to the square of its corners in steps, which `budget` pays for: a few
// nanoseconds each. Returns false when nothing is left, so a file gets one budget for all polygons.
inline constexpr std::uint64_t kTriangulationBudget = std::uint64_t{1} << 30;
bool triangulate(std::span<const glm::dvec3> corners, std::vector<glm::uvec3>& triangles,
                 std::uint64_t& budget);

}  // namespace solidtex::mesh
