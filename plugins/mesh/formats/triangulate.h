// Triangulation of polygons.
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace solidtex::mesh {

// Appends triangles of indices into `corners`, with the orientation of the polygon. The polygon may
// be concave and slightly bent. Every corner is used, which keeps closed surfaces closed; a simple
// polygon gives no degenerate triangles. Repeated corners are skipped; fewer than three distinct
// corners give no triangle. Returns false for a polygon that is too complex for reasonable time.
bool triangulate(std::span<const glm::dvec3> corners, std::vector<glm::uvec3>& triangles);

}  // namespace solidtex::mesh
