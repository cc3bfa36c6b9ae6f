// Preview of a material: a cube cut open, three slices along the axes, one at 45 degrees.
#pragma once

#include <filesystem>
#include <string>

#include "tools/bake/volume.h"

namespace solidtex::tools {

// The cube begins at the volume's origin and is as large as the volume, clamped to 128 to 192
// voxels. `group` is the channel group to show (see channel_group). Throws Interrupted after
// Ctrl-C.
void write_preview(const std::filesystem::path& path, const Volume& volume,
                   const std::string& group);

}  // namespace solidtex::tools
