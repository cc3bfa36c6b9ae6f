// Replaces mesh_repair_cgal.cpp and mesh_cut_cgal.cpp in a build without CGAL.
#include "plugins/pathtracer/geometry/mesh.h"
#include "solidtex/pathtracer.hpp"

namespace solidtex::pathtracer {

bool can_repair_meshes() { return false; }

MeshReport repair_mesh(Mesh&) { return {}; }

Mesh cut_mesh(const Mesh& mesh, const std::vector<Cut>&) {
  throw SceneError(mesh.file +
                   ": found cuts, expected none, because solidtex-render was built without CGAL");
}

}  // namespace solidtex::pathtracer
