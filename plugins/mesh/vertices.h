// Values of a solid texture at the vertices of a mesh.
#pragma once

#include <cstddef>
#include <solidtex/solidtex.hpp>
#include <span>
#include <vector>

#include "plugins/mesh/placement.h"

namespace solidtex::mesh {

// Merges vertices with the same bits, in the order of their first appearance, if each corner of a
// face has its own vertex (as in OBJ files). Returns a mesh with shared vertices (as in PLY files)
// unchanged.
Mesh share_vertices(Mesh mesh);

// Returns half the mean length of the edges at each vertex, in units of the mesh, 0 without edges.
// Interpolation between vertices shows no finer detail.
std::vector<float> vertex_radii(const Mesh& mesh);

// Returns values [vertex][channel] of vertices from `first` on, one for each radius: means over
// cubes with edges of twice the radius, in units of the mesh (vertex_radii, or zeros). Queries run
// on the calling thread's oneTBB arena. Throws solidtex::error.
std::vector<float> evaluate_vertices(const Mesh& mesh, const Placement& placement,
                                     const texture& texture, std::size_t first,
                                     std::span<const float> radii);

}  // namespace solidtex::mesh
