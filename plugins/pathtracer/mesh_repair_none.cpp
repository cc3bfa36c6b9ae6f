// Stands in for mesh_repair_cgal.cpp in a build without CGAL.
#include "plugins/pathtracer/mesh.h"

namespace solidtex::pathtracer {

bool can_repair_meshes() { return false; }

MeshReport repair_mesh(Mesh&) { return {}; }

}  // namespace solidtex::pathtracer
