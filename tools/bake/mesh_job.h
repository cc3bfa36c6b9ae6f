// A solid texture on a mesh: as colours of its vertices, or as the picture of its UV atlas.
#pragma once

#include <filesystem>
#include <solidtex/solidtex.hpp>

#include "tools/bake/options.h"

namespace solidtex::tools {

// Throws where the options of a mesh contradict each other, or this build knows no meshes.
void check_mesh_options(const BakeOptions& options);

// Bakes options.mesh into a file that will be called options.output in the end.
void bake_mesh(const BakeOptions& options, const solidtex::texture& texture,
               const std::filesystem::path& file);

}  // namespace solidtex::tools
