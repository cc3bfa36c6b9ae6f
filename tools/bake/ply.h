// PLY files with whatever is known of their vertices.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "plugins/mesh/mesh.h"

namespace solidtex::tools {

struct PlyProperty {
  std::string name;
  bool is_byte;               // uchar from values in [0, 1], else float
  std::vector<float> values;  // one a vertex
};

// Binary: positions, normals (nx, ny, nz) and texture coordinates (s, t) where the mesh has some,
// then the properties; triangles. Throws WriteError, and std::runtime_error for two properties of
// one name.
void write_ply(const std::filesystem::path& path, const mesh::Mesh& mesh,
               const std::vector<PlyProperty>& properties);

}  // namespace solidtex::tools
