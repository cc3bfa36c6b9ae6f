// Writes glTF 2.0 in one binary file.
#pragma once

#include <filesystem>

#include "plugins/mesh/mesh.h"
#include "tools/bake/maps.h"

namespace solidtex::tools {

// Writes the mesh with one material: base color, roughness and metallic, and a normal map in the
// convention of glTF (green up), as PNG images in the file. Other maps are left out. Throws
// WriteError.
void write_glb(const std::filesystem::path& path, const mesh::Mesh& mesh, const MapSet& maps);

}  // namespace solidtex::tools
