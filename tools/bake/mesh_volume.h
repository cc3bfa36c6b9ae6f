// Bakes the inside of a closed mesh to a sparse OpenVDB or NanoVDB file.
#pragma once

#include <filesystem>

#include "plugins/mesh/placement.h"
#include "tools/bake/output.h"

namespace solidtex::tools {

// Evaluates the voxels whose centers are inside the mesh; the grids lie where the mesh lies. Throws
// std::runtime_error for a mesh that is not closed.
void bake_inside(const Output& output, const mesh::Mesh& mesh, const mesh::Placement& placement,
                 const solidtex::texture& texture, const std::filesystem::path& file);

}  // namespace solidtex::tools
