// Reads image files as linear colors. solidtex/image.hpp declares the writers.
#pragma once

#include <filesystem>

#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

enum class ImageEncoding { automatic, srgb, linear };

// Reads any image that OpenImageIO can. `automatic`: whole-number formats are sRGB, floats linear.
// Throws SceneError, naming the file, when it cannot be read or holds a value that is not finite.
ColorImage read_image(const std::filesystem::path& file, ImageEncoding encoding);

}  // namespace solidtex::pathtracer
