// Bakes a solid texture onto a mesh: to colors of its vertices, or to its UV atlas.
#pragma once

#include <filesystem>
#include <solidtex/solidtex.hpp>

#include "tools/bake/options.h"

namespace solidtex::tools {

// Throws when options of a mesh contradict each other, or this build reads no meshes.
void check_mesh_options(const BakeOptions& options);

// Bakes options.mesh to `file`, a temporary name of options.output.
void bake_mesh(const BakeOptions& options, const solidtex::texture& texture,
               const std::filesystem::path& file);

}  // namespace solidtex::tools
