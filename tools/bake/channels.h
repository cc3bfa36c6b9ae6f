// Groups of a model's channels, and their encoding in files and on screens.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <solidtex/solidtex.hpp>
#include <span>
#include <string>
#include <vector>

#include "plugins/common/srgb.h"

namespace solidtex::tools {

// How the values of a group are encoded.
enum class Encoding { srgb, linear, data };

struct ChannelGroup {
  std::string name;                   // "albedo", or the full name of a single channel
  std::vector<std::size_t> channels;  // indices of red, green and blue, or of the only one
  Encoding encoding;
};

// NAME.r, NAME.g and NAME.b are one group, wherever they are in the file. Groups are in the order
// of their first channels.
std::vector<ChannelGroup> channel_groups(const solidtex::texture& texture);

// Returns the group called `name`. An empty name means albedo, or the first group without albedo.
// Throws, naming the option and listing all names, if there is no such group.
ChannelGroup channel_group(const solidtex::texture& texture, const std::string& name,
                           const std::string& option = "--show");

// Returns the encoding of each channel.
std::vector<Encoding> channel_encodings(const solidtex::texture& texture);

// Returns the name of each channel in an EXR: albedo is R, G and B, which viewers look for.
std::vector<std::string> exr_names(const solidtex::texture& texture);

// Throws if a model's weights are so large that its values [...][channel] are not finite.
void check_values(const solidtex::texture& texture, std::span<const float> values);

// Encodes linear colors as sRGB, for 8 bits.
inline float display_value(float value, Encoding encoding) {
  return encoding == Encoding::linear ? linear_to_srgb(value) : value;
}

// Decodes sRGB colors to linear light, for floats.
inline float light_value(float value, Encoding encoding) {
  return encoding == Encoding::srgb ? srgb_to_linear(value) : value;
}

// Quantizes a value in [0, 1] to the range of an unsigned integer, clamped. NaN is 0.
template <class Integer>
Integer quantize(float value) {
  constexpr float max = std::numeric_limits<Integer>::max();
  return value > 0 ? static_cast<Integer>(std::lround(std::min(value, 1.0f) * max)) : Integer{0};
}

}  // namespace solidtex::tools
