// Triangle meshes, loaded through assimp, for whatever needs one: the renderer, the baker, plugins.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace solidtex::mesh {

// A mesh cannot be used. what() names the file, what was found and what was expected.
struct MeshError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// normals and uvs are empty, or as long as positions.
struct Mesh {
  std::string file;
  std::vector<glm::vec3> positions, normals;
  std::vector<glm::vec2> uvs;
  std::vector<glm::uvec3> triangles;
};

// Reads an OBJ or PLY file. Throws MeshError, naming the file, for a mesh that is missing, cannot
// be read, is empty, has a vertex that is not finite or a face that refers to no vertex.
Mesh load_mesh(const std::filesystem::path& file);

}  // namespace solidtex::mesh
