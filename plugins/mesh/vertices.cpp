#include "plugins/mesh/vertices.h"

#include <cstdint>
#include <cstring>
#include <string>
#include <unordered_map>

namespace solidtex::mesh {
namespace {

// All that is known of a vertex, bit for bit.
std::string bytes_of(const Mesh& mesh, unsigned vertex) {
  std::string bytes;
  const auto add = [&](const auto& values) {
    if (values.empty()) return;
    bytes.append(reinterpret_cast<const char*>(&values[vertex]), sizeof values[vertex]);
  };
  add(mesh.positions);
  add(mesh.normals);
  add(mesh.uvs);
  return bytes;
}

}  // namespace

Mesh share_vertices(Mesh mesh) {
  if (mesh.positions.size() < 3 * mesh.triangles.size()) return mesh;
  Mesh shared;
  shared.file = mesh.file;
  std::unordered_map<std::string, unsigned> known;
  std::vector<unsigned> index(mesh.positions.size());
  for (unsigned v = 0; v < mesh.positions.size(); ++v) {
    const auto next = static_cast<unsigned>(shared.positions.size());
    const auto [entry, is_new] = known.try_emplace(bytes_of(mesh, v), next);
    index[v] = entry->second;
    if (!is_new) continue;
    shared.positions.push_back(mesh.positions[v]);
    if (!mesh.normals.empty()) shared.normals.push_back(mesh.normals[v]);
    if (!mesh.uvs.empty()) shared.uvs.push_back(mesh.uvs[v]);
  }
  for (const glm::uvec3& t : mesh.triangles) {
    shared.triangles.emplace_back(index[t.x], index[t.y], index[t.z]);
  }
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
