// Loads and cuts the meshes of a scene file.
#pragma once

#include <map>
#include <set>
#include <string>

#include "plugins/pathtracer/geometry/mesh.h"
#include "plugins/pathtracer/reader/scene_file.h"
#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

// Loads meshes into the scene. Objects with the same file, cuts and attribute share one mesh.
class MeshReader {
 public:
  MeshReader(const SceneFile& file, Scene& scene) : file_(file), scene_(scene) {}

  // Returns the index of the mesh of the object at this place, with an attribute of its vertices if
  // that is not "".
  std::size_t mesh_of(const Place& object, const std::string& attribute);

  // Returns the bounding box of the object's mesh file, before cuts.
  const mesh::Box& box_of(std::size_t mesh) const { return boxes_.at(mesh); }

  // Whether a mesh is known to have holes: a build without CGAL does not know.
  bool is_open(const Mesh& mesh) const { return open_files_.contains(mesh.file); }

  // Loads and repairs the mesh file named at this place, without adding it to the scene.
  Mesh read_mesh(const Place& place, const std::string& attribute = "");

 private:
  Mesh cut(const Place& place, const Mesh& mesh);
  Cut read_cut(const Place& place, const Mesh& mesh);
  Mesh read_tool(const Place& place);

  const SceneFile& file_;
  Scene& scene_;
  std::map<std::string, std::size_t> meshes_;
  std::map<std::size_t, mesh::Box> boxes_;
  std::set<std::string> open_files_;
};

}  // namespace solidtex::pathtracer
