// Finds the color channels of an image file with several parts, layers or pages.
#pragma once

#include <OpenImageIO/imageio.h>

#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace solidtex::pathtracer {

struct ColorLayer {
  OIIO::ImageSpec spec;  // of the part
  int part = 0;          // index, OpenImageIO's "subimage"
  std::array<int, 3> channels{0, 0, 0};
};

// In an EXR the channels R, G, B come first, then a layer with a color name ("Beauty", "Combined",
// "rgb"), then the only layer that is not a known data pass ("AO", "normal", "Z"). Of other formats
// this is the largest page. Appends a line to `notes` if there was a choice. Throws SceneError,
// listing the layers, if none or several qualify.
ColorLayer find_color_layer(OIIO::ImageInput& input, const std::filesystem::path& file,
                            std::vector<std::string>& notes);

}  // namespace solidtex::pathtracer
