// Images as solidtex-bake writes them: sRGB for the eye (PNG), or floats as they are (EXR).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace solidtex::tools {

float srgb_to_linear(float value);
float linear_to_srgb(float value);

struct Image {
  int width = 0, height = 0, channels = 0;
  std::vector<float> values;  // row by row from the top

  Image(int w, int h, int c)
      : width(w),
        height(h),
        channels(c),
        values(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) *
               static_cast<std::size_t>(c)) {}
  float* pixel(int x, int y) {
    return &values[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                    static_cast<std::size_t>(x)) *
                   static_cast<std::size_t>(channels)];
  }
};

// 8 bits a channel, one or three of them, sRGB-encoded values in [0, 1], clamped.
void write_png(const std::filesystem::path& path, const Image& image);

// 32-bit float channels of the given names.
void write_exr(const std::filesystem::path& path, const Image& image,
               const std::vector<std::string>& names);

}  // namespace solidtex::tools
