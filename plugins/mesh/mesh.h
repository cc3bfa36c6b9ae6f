// Triangle meshes for whatever needs one: the renderer, the baker, plugins.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace solidtex::mesh {

// A mesh cannot be used. what() names the file, what was found and what was expected.
struct MeshError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// normals and uvs are empty, or as long as positions.
struct Mesh {
  std::string file;
  std::vector<glm::vec3> positions, normals;  // positions relative to the origin
  std::vector<glm::vec2> uvs;
  std::vector<glm::uvec3> triangles;

  // Zero, unless the mesh lies so far away that single precision would lose its detail there.
  glm::dvec3 origin{0};
  // By how much a coordinate may differ from the one that was exported, in the mesh's units.
  double rounding_error = 0;
  // What reading the file found worth saying, one line each, without the file's name.
  std::vector<std::string> warnings{};

  glm::dvec3 position(std::size_t vertex) const { return origin + glm::dvec3(positions[vertex]); }
};

// The formats that load_mesh reads, for messages.
inline constexpr const char* kMeshFormats = "*.ply, *.obj, *.gltf, *.glb, *.stl or *.off";

// Reads a PLY, OBJ, glTF, STL or OFF file, told by its extension in small or capital letters.
// Polygons become triangles. Throws MeshError for a mesh that is missing, cannot be read, is
// empty, has a vertex that is not finite or a face that refers to no vertex.
Mesh load_mesh(const std::filesystem::path& file);

// What a file holds in place of a mesh or an image: nothing, an HTML page, an archive ...
struct OtherContent {
  std::string found, remedy;
};
inline constexpr std::size_t kOtherContentSize = 256;

// Told by the first kOtherContentSize bytes.
std::optional<OtherContent> find_other_content(std::string_view content);

// A warning where rounding moves the mesh by a large part of a texel or more, else empty.
std::string rounding_warning(const Mesh& mesh, double texels_per_unit);

}  // namespace solidtex::mesh
