// The channels of a model: which belong together, and how files and screens encode them.
#pragma once

#include <solidtex/solidtex.hpp>
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

// The group called `name`. An empty name stands for albedo, or the first group where there is no
// albedo. Throws with all names when there is no such group.
ChannelGroup channel_group(const solidtex::texture& texture, const std::string& name);

// The encoding of each channel.
std::vector<Encoding> channel_encodings(const solidtex::texture& texture);

// The name of each channel in an EXR: albedo is R, G and B, which viewers look for.
std::vector<std::string> exr_names(const solidtex::texture& texture);

// For 8 bits: linear colors become sRGB.
inline float display_value(float value, Encoding encoding) {
  return encoding == Encoding::linear ? linear_to_srgb(value) : value;
}

// For floats: sRGB colors become linear light.
inline float light_value(float value, Encoding encoding) {
  return encoding == Encoding::srgb ? srgb_to_linear(value) : value;
}

}  // namespace solidtex::tools
