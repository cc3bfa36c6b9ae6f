// Reads image files as linear colors. solidtex/image.hpp declares the writers.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

enum class ImageEncoding { automatic, srgb, linear };

// Valid values of an image: inputs of materials are from 0 to 1, radiance is unbounded.
enum class ImageRange { unit, radiance };

// Reads one of solidtex::kImageFormats. `automatic` decodes integer formats as sRGB, float formats
// as linear. Chooses the color layer of an EXR with several parts or layers, and fills its display
// window; pixels outside the data window are black. Clamps small negative values. Appends a line to
// `notes` for every choice and conversion. Throws SceneError, naming the file, if it cannot be
// read, has no color layer or several, or holds values that are not finite or far out of range.
ColorImage read_image(const std::filesystem::path& file, ImageEncoding encoding, ImageRange range,
                      std::vector<std::string>& notes);

}  // namespace solidtex::pathtracer
