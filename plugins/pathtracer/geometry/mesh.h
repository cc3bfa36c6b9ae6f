// Checks and repair of the renderer's meshes.
#pragma once

#include <cstddef>
#include <string>

#include "plugins/mesh/mesh.h"

namespace solidtex::pathtracer {

using mesh::load_mesh;
using mesh::Mesh;

// What repair_mesh found and did.
struct MeshReport {
  std::size_t removed_faces = 0;  // degenerate or duplicate
  std::size_t flipped_faces = 0;
  std::size_t component_count = 0, hole_count = 0;
  bool closed = false;
};

// True when this build has CGAL; otherwise repair_mesh does nothing.
bool can_repair_meshes();

// Removes duplicate and degenerate faces, gives all faces of a component one orientation, outward
// for closed ones. Keeps vertices and their attributes.
MeshReport repair_mesh(Mesh& mesh);

// One line: what was found in this mesh and changed.
std::string describe(const Mesh& mesh, const MeshReport& report);

}  // namespace solidtex::pathtracer
