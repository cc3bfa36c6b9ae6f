#include "plugins/mesh/vertices.h"

#include "plugins/mesh/vertex_table.h"

namespace solidtex::mesh {

Mesh share_vertices(Mesh mesh) {
  if (mesh.positions.size() < 3 * mesh.triangles.size()) return mesh;
  Mesh shared = mesh;
  shared.positions.clear(), shared.normals.clear(), shared.uvs.clear();
  shared.attribute.clear();
  VertexTable table(shared, !mesh.normals.empty(), !mesh.uvs.empty());
  std::vector<unsigned> index(mesh.positions.size());
  for (std::size_t v = 0; v < index.size(); ++v) {
    index[v] = table.add(mesh.positions[v], mesh.normals.empty() ? glm::vec3(0) : mesh.normals[v],
                         mesh.uvs.empty() ? glm::vec2(0) : mesh.uvs[v]);
  }
  for (glm::uvec3& t : shared.triangles) t = {index[t.x], index[t.y], index[t.z]};
  return shared;
}

std::vector<float> vertex_radii(const Mesh& mesh) {
  std::vector<double> lengths(mesh.positions.size());
  std::vector<unsigned> counts(mesh.positions.size());
  for (const glm::uvec3& t : mesh.triangles) {
    for (int side = 0; side < 3; ++side) {
      const unsigned a = t[side], b = t[(side + 1) % 3];
      const double length =
          glm::distance(glm::dvec3(mesh.positions[a]), glm::dvec3(mesh.positions[b]));
      for (const unsigned end : {a, b}) {
        lengths[end] += length;
        ++counts[end];
      }
    }
  }
  std::vector<float> radii(lengths.size());
  for (std::size_t v = 0; v < radii.size(); ++v) {
    if (counts[v] > 0) radii[v] = static_cast<float>(lengths[v] / (2.0 * counts[v]));
  }
  return radii;
}

std::vector<float> evaluate_vertices(const Mesh& mesh, const Placement& placement,
                                     const texture& texture, std::size_t first,
                                     std::span<const float> radii) {
  const double scale = placement.texels_per_unit;
  std::vector<float> points, sizes;
  points.reserve(3 * radii.size());
  for (std::size_t i = 0; i < radii.size(); ++i) {
    const glm::vec3 point(glm::dvec3(mesh.positions[first + i]) * scale);
    points.insert(points.end(), {point.x, point.y, point.z});
    sizes.push_back(static_cast<float>(static_cast<double>(radii[i]) * scale));
  }
  std::vector<float> values(radii.size() * texture.channel_count());
  texture.eval_filtered(placement.origin, points, sizes, values);
  return values;
}

}  // namespace solidtex::mesh
