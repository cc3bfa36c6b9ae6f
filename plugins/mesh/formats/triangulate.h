// Polygons into triangles.
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace solidtex::mesh {

// Appends triangles of indices into `corners`, which go round as the polygon does. The polygon may
// be concave and need not be quite flat. Every corner is used and, where the polygon is simple, no
// triangle is without area, so that closed surfaces stay closed. Corners at the place of the one
// before are left out; a polygon of fewer than three places gives none. False for a polygon that
// is too large and intricate to be split in reasonable time.
bool triangulate(std::span<const glm::dvec3> corners, std::vector<glm::uvec3>& triangles);

}  // namespace solidtex::mesh
