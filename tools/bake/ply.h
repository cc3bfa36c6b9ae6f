// Writes PLY files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "plugins/mesh/mesh.h"

namespace solidtex::tools {

struct PlyProperty {
  std::string name;
  bool is_byte;               // uchar from values in [0, 1], else float
  std::vector<float> values;  // one for each vertex
};

// Writes binary PLY: positions, normals (nx, ny, nz) and texture coordinates (s, t) if present, the
// properties, then the triangles. Throws WriteError, and std::runtime_error for two properties with
// the same name.
void write_ply(const std::filesystem::path& path, const mesh::Mesh& mesh,
               const std::vector<PlyProperty>& properties);

}  // namespace solidtex::tools
