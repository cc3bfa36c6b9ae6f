// Mesh files in memory, and what is known of the meshes in them.
#pragma once

#include <bit>
#include <string>
#include <vector>

#include "plugins/mesh/formats/readers.h"

namespace mesh_tests {

using namespace solidtex::mesh;

// The box of 1 x 2 x 3: area 22, volume 6.
inline const std::vector<glm::dvec3> kCorners = {{0, 0, 0}, {1, 0, 0}, {1, 2, 0}, {0, 2, 0},
                                                 {0, 0, 3}, {1, 0, 3}, {1, 2, 3}, {0, 2, 3}};
inline const std::vector<std::vector<int>> kSides = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                                     {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};

inline double area(const Mesh& mesh) {
  double sum = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a(mesh.positions[t.x]);
    sum += glm::length(glm::cross(glm::dvec3(mesh.positions[t.y]) - a,
                                  glm::dvec3(mesh.positions[t.z]) - a)) /
           2;
  }
  return sum;
}

inline double volume(const Mesh& mesh) {
  double sum = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    sum += glm::dot(glm::dvec3(mesh.positions[t.x]),
                    glm::cross(glm::dvec3(mesh.positions[t.y]), glm::dvec3(mesh.positions[t.z]))) /
           6;
  }
  return sum;
}

using Reader = PolygonMesh (*)(const std::string& file, std::string_view content);

inline Mesh mesh_of(Reader read, const std::string& content) {
  return to_mesh(read("a file", content));
}

// The message with which content is refused.
inline std::string refusal(Reader read, const std::string& content) {
  try {
    mesh_of(read, content);
  } catch (const MeshError& error) {
    return error.what();
  }
  return "(accepted)";
}

// A number's bytes, in the order of this machine or the other one.
template <class T>
std::string bytes_of(T value, bool big_endian = false) {
  std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
  if (big_endian != (std::endian::native == std::endian::big)) {
    bytes.assign(bytes.rbegin(), bytes.rend());
  }
  return bytes;
}

}  // namespace mesh_tests
