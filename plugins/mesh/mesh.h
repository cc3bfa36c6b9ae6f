// Triangle meshes of the renderer, the baker and plugins.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace solidtex::mesh {

// An invalid mesh. what() names the file, what was found and what was expected.
struct MeshError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// normals, uvs and attribute are empty, or as long as positions.
struct Mesh {
  std::string file;
  std::vector<glm::vec3> positions, normals;  // positions relative to the origin
  std::vector<glm::vec2> uvs;
  std::vector<glm::uvec3> triangles;

  // Zero unless the mesh is so far away that single precision would lose detail.
  glm::dvec3 origin{0};
  // Largest difference of a coordinate from the exported one, in units of the mesh.
  double rounding_error = 0;
  // Warnings of the reader, one line each, without the file's name.
  std::vector<std::string> warnings{};
  // Of each vertex, if load_mesh was asked for one.
  std::vector<float> attribute{};

  glm::dvec3 position(std::size_t vertex) const { return origin + glm::dvec3(positions[vertex]); }
};

// Axis-aligned bounding box.
struct Box {
  glm::dvec3 low{0}, high{0};

  double longest_side() const {
    const glm::dvec3 size = high - low;
    return glm::max(size.x, glm::max(size.y, size.z));
  }
};

// Returns the bounding box of a mesh's vertices, origin included.
Box bounding_box(const Mesh& mesh);

// Formats of load_mesh, for messages.
inline constexpr const char* kMeshFormats = "*.ply, *.obj, *.gltf, *.glb, *.stl or *.off";

// Reads a PLY, OBJ, glTF, STL or OFF file by its extension, in lower or upper case. Triangulates
// polygons. Throws MeshError for a mesh that is missing, unreadable or empty, has a vertex that is
// not finite, or a face with an invalid vertex index. `attribute` names a property of the vertices
// of a PLY file to read, "" means none; whole numbers of 8 and 16 bits become fractions of 255 and
// 65535.
Mesh load_mesh(const std::filesystem::path& file, const std::string& attribute = "");

// Other content in place of a mesh or an image (nothing, an HTML page, an archive ...), and its
// remedy.
struct OtherContent {
  std::string found, remedy;
};
inline constexpr std::size_t kOtherContentSize = 256;

// Recognizes other content by the first kOtherContentSize bytes.
std::optional<OtherContent> find_other_content(std::string_view content);

// Returns a warning if rounding moves the mesh by a large part of a texel or more, else "".
std::string rounding_warning(const Mesh& mesh, double texels_per_unit);

}  // namespace solidtex::mesh
