// Reads a photograph for an encoder.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace solidtex::tools {

// Pixels [row][column][channel] with three sRGB channels, upright.
struct Photograph {
  std::size_t width = 0, height = 0;
  std::vector<float> pixels;
  std::vector<std::string> notes;  // what reading changed or left out
};

// Reads an image file of any kind that OpenImageIO knows: gray or RGB, without or with opaque
// alpha. Floats are linear, integers sRGB. While it reads it averages whole blocks of pixels, as
// long as the shorter side keeps at least `least_side` pixels: a file of any size needs little
// memory. `patch`: the least side of the file; the message for a smaller one ends with
// `otherwise`.
Photograph read_photograph(const std::filesystem::path& path, std::size_t least_side,
                           std::size_t patch, const std::string& otherwise = "");

}  // namespace solidtex::tools
