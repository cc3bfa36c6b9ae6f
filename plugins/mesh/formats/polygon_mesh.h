// What the readers of mesh files deliver, and how it becomes a triangle mesh.
#pragma once

#include <cstdint>
#include <limits>

#include "plugins/mesh/mesh.h"

namespace solidtex::mesh {

// Polygons whose corners refer to positions, normals and texture coordinates apart.
struct PolygonMesh {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  struct Corner {
    std::uint32_t position = 0, normal = kNone, uv = kNone;
  };

  std::string file;
  std::vector<glm::dvec3> positions;
  std::vector<glm::vec3> normals;
  std::vector<glm::vec2> uvs;
  std::vector<Corner> corners;            // of all faces, one after the other
  std::vector<std::uint32_t> face_sizes;  // corners of each face
  bool keeps_vertices = false;            // vertices stay as they are in the file
  double rounding_error = 0;              // of the file's own number format
  std::vector<std::string> warnings;

  void end_face(std::size_t corner_count) {
    face_sizes.push_back(static_cast<std::uint32_t>(corner_count));
  }
};

[[noreturn]] void refuse(const std::string& file, const std::string& found,
                         const std::string& expected);

// "1 face", "2 faces".
std::string count_of(std::uint64_t count, const std::string& noun);

// Splits polygons into triangles, and vertices where normals or texture coordinates of their
// corners differ; moves the origin where that keeps precision. Faces of fewer than three vertices
// are dropped and counted. Throws MeshError.
Mesh to_mesh(PolygonMesh polygons);

}  // namespace solidtex::mesh
