// Output files of solidtex-render.
#pragma once

#include <filesystem>
#include <solidtex/pathtracer.hpp>
#include <string>

#include "tools/render/options.h"

namespace solidtex::tools {

// Checks before rendering. All throw, naming the file and the problem.
void check_output(const std::filesystem::path& output, const Options& options);
void check_checkpoint(const Options& options);
// Checks that the image fits into memory and its file on the disk.
void check_room(const pathtracer::RenderSettings& settings, const std::filesystem::path& output);

// Writes all AOVs to an EXR, or the first one to a PNG, completely or not at all. Returns the
// legend of a PNG's colors, if any.
std::string write_image(const pathtracer::AovImage& image, const pathtracer::Display& display,
                        const std::filesystem::path& output);

}  // namespace solidtex::tools
