// One picture from first sample to file, with what keeps a long render safe on the way.
#pragma once

#include <solidtex/pathtracer.hpp>

#include "tools/render/options.h"

namespace solidtex::tools {

// Throws Interrupted after Ctrl-C, when what is done is in the checkpoint, if there is to be one.
void render_picture(const pathtracer::Scene& scene, const Options& options,
                    const std::filesystem::path& output);

}  // namespace solidtex::tools
