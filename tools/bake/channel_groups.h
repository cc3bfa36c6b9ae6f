// Which channels belong together: albedo.r, albedo.g and albedo.b are one colour.
#pragma once

#include <solidtex/solidtex.hpp>
#include <string>
#include <vector>

namespace solidtex::tools {

// How the values of a group are encoded.
enum class Encoding { srgb, linear, data };

struct ChannelGroup {
  std::string name;                   // "albedo", or the full name of a single channel
  std::vector<std::size_t> channels;  // indices of red, green and blue, or of the only one
  Encoding encoding;
};

// NAME.r, NAME.g and NAME.b are one group, wherever they stand; in the order of their first ones.
std::vector<ChannelGroup> channel_groups(const solidtex::texture& texture);

// The group called `name`; for an empty name albedo, or the first where there is none. Throws with
// all names when there is no such group.
ChannelGroup channel_group(const solidtex::texture& texture, const std::string& name);

}  // namespace solidtex::tools
