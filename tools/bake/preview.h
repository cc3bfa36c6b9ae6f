// A picture of the material for the eye: a cube cut open, three slices along the axes, one at 45
// degrees.
#pragma once

#include <filesystem>

#include "tools/bake/volume.h"

namespace solidtex::tools {

// The cube begins at the volume's origin and is as large as the volume, within 128 to 192 voxels.
// Throws Interrupted after Ctrl-C.
void write_preview(const std::filesystem::path& path, const Volume& volume);

}  // namespace solidtex::tools
