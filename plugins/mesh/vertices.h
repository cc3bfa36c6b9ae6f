// The values of a solid texture at the vertices of a mesh.
#pragma once

#include <cstddef>
#include <solidtex/solidtex.hpp>
#include <span>
#include <vector>

#include "plugins/mesh/placement.h"

namespace solidtex::mesh {

// The mesh as it is where faces share vertices, as in PLY files. Where each corner of a face has a
// vertex of its own, as of OBJ files, those become one of which all that is known has the same
// bits, in the order of their first appearance.
Mesh share_vertices(Mesh mesh);

// Half of the mean length of the edges at each vertex, in the mesh's own units; 0 where there are
// none. What is interpolated between vertices shows nothing finer than that.
std::vector<float> vertex_radii(const Mesh& mesh);

// Values [vertex][channel] of the vertices from `first` on, as many as there are radii: each the
// mean over a cube of twice its radius, which is in the mesh's units (vertex_radii, or zeros).
// Queries run on the calling thread's oneTBB arena. Throws solidtex::error.
std::vector<float> evaluate_vertices(const Mesh& mesh, const Placement& placement,
                                     const texture& texture, std::size_t first,
                                     std::span<const float> radii);

}  // namespace solidtex::mesh
