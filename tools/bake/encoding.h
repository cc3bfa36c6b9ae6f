// Values of a model as files show them: colours encoded for the eye, or as light.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "tools/bake/channel_groups.h"
#include "tools/bake/image.h"

namespace solidtex::tools {

// For 8 bits: linear colours become sRGB.
inline float display_value(float value, Encoding encoding) {
  return encoding == Encoding::linear ? linear_to_srgb(value) : value;
}

// For floats: sRGB colours become light.
inline float light_value(float value, Encoding encoding) {
  return encoding == Encoding::srgb ? srgb_to_linear(value) : value;
}

// What is not a number is black.
inline std::uint8_t to_8_bits(float value) {
  return value > 0 ? static_cast<std::uint8_t>(std::lround(std::min(value, 1.0f) * 255)) : 0;
}

// How each channel is encoded.
std::vector<Encoding> channel_encodings(const solidtex::texture& texture);

// The channels' names in an EXR: the albedo is R, G and B, which viewers look for.
std::vector<std::string> exr_names(const solidtex::texture& texture);

}  // namespace solidtex::tools
