// Polygon mesh, the result of the file readers, and its conversion to triangles.
#pragma once

#include <cstdint>
#include <limits>

#include "plugins/mesh/mesh.h"

namespace solidtex::mesh {

// Polygons with separate indices for positions, normals and texture coordinates.
struct PolygonMesh {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  struct Corner {
    std::uint32_t position = 0, normal = kNone, uv = kNone;
  };

  std::string file;
  std::vector<glm::dvec3> positions;
  std::vector<glm::vec3> normals;
  std::vector<glm::vec2> uvs;
  std::vector<float> attribute;           // empty, or of each position
  std::vector<Corner> corners;            // of all faces, in order
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

// Triangulates polygons, splits vertices whose corners differ in normal or texture coordinates, and
// moves the origin if that keeps precision. Drops and counts faces of fewer than three vertices.
// Throws MeshError.
Mesh to_mesh(PolygonMesh polygons);

}  // namespace solidtex::mesh
