// Renders one image to a file, with previews and checkpoints.
#pragma once

#include <solidtex/pathtracer.hpp>

#include "tools/render/options.h"

namespace solidtex::tools {

// Throws Interrupted after Ctrl-C. The checkpoint, if any, is then saved.
void render_image(const pathtracer::Scene& scene, const Options& options,
                  const std::filesystem::path& output);

}  // namespace solidtex::tools
