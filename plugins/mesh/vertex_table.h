// Merges equal vertices.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <unordered_map>

#include "plugins/mesh/mesh.h"

namespace solidtex::mesh {

// Adds vertices to a mesh. Vertices with the same bits of position, normal and texture coordinates
// are one vertex.
class VertexTable {
 public:
  VertexTable(Mesh& mesh, bool has_normals, bool has_uvs)
      : mesh_(mesh), has_normals_(has_normals), has_uvs_(has_uvs) {}

  unsigned add(const glm::vec3& p, const glm::vec3& normal, const glm::vec2& uv) {
    const Key key = {p.x, p.y, p.z, normal.x, normal.y, normal.z, uv.x, uv.y};
    const auto next = static_cast<unsigned>(mesh_.positions.size());
    const auto [entry, is_new] = known_.try_emplace(std::bit_cast<Bits>(key), next);
    if (is_new) {
      mesh_.positions.push_back(p);
      if (has_normals_) mesh_.normals.push_back(normal);
      if (has_uvs_) mesh_.uvs.push_back(uv);
    }
    return entry->second;
  }

 private:
  using Key = std::array<float, 8>;
  using Bits = std::array<std::uint32_t, 8>;
  struct Hash {
    std::size_t operator()(const Bits& bits) const {
      std::uint64_t hash = 0;
      for (const std::uint32_t word : bits) {
        hash = (hash ^ word) * 0x9e3779b97f4a7c15ull;
        hash ^= hash >> 32;
      }
      return static_cast<std::size_t>(hash);
    }
  };

  Mesh& mesh_;
  bool has_normals_, has_uvs_;
  std::unordered_map<Bits, unsigned, Hash> known_;
};

}  // namespace solidtex::mesh
