// Triangle meshes: loading through assimp, checks, repair.
#pragma once

#include <cstddef>
#include <filesystem>
#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace solidtex::pathtracer {

// normals and uvs are empty, or as long as positions.
struct Mesh {
  std::string file;
  std::vector<glm::vec3> positions, normals;
  std::vector<glm::vec2> uvs;
  std::vector<glm::uvec3> triangles;
};

// What repair_mesh found and did.
struct MeshReport {
  std::size_t removed_faces = 0;  // degenerate or duplicate
  std::size_t flipped_faces = 0;
  std::size_t component_count = 0, hole_count = 0;
  bool closed = false;
};

// Reads an OBJ or PLY file. Throws SceneError, naming the file, for a mesh that is missing, cannot
// be read, is empty, has a vertex that is not finite or a face that refers to no vertex.
Mesh load_mesh(const std::filesystem::path& file);

// True when this build has CGAL; otherwise repair_mesh does nothing.
bool can_repair_meshes();

// Removes duplicate and degenerate faces, gives all faces of a component one orientation, outward
// for closed ones. Keeps vertices and their attributes.
MeshReport repair_mesh(Mesh& mesh);

// One line: what was found in this mesh and changed.
std::string describe(const Mesh& mesh, const MeshReport& report);

}  // namespace solidtex::pathtracer
