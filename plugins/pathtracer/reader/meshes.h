// Meshes that the objects of a scene file name, cut as they ask.
#pragma once

#include <map>

#include "plugins/pathtracer/geometry/mesh_cut.h"
#include "plugins/pathtracer/reader/scene_file.h"
#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

// Puts what it loads into the scene; a file that several objects name, cut in the same way, is
// loaded once and instanced.
class MeshReader {
 public:
  MeshReader(const SceneFile& file, Scene& scene) : file_(file), scene_(scene) {}

  // Index of the mesh of the object at this place.
  std::size_t mesh_of(const Place& object);

  // The mesh in the file that is named at this place, repaired; not put into the scene.
  Mesh read_mesh(const Place& place);

 private:
  Mesh cut(const Place& place, const Mesh& mesh);
  Cut read_cut(const Place& place, const Mesh& mesh);
  Mesh read_tool(const Place& place);

  const SceneFile& file_;
  Scene& scene_;
  std::map<std::string, std::size_t> meshes_;
};

}  // namespace solidtex::pathtracer
