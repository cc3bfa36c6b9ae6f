// Which channels belong together: "albedo.r, albedo.g, albedo.b" are one colour.
#pragma once

#include <solidtex/solidtex.hpp>
#include <string>
#include <vector>

namespace solidtex::tools {

// How the values of a group are encoded.
enum class Encoding { srgb, linear, data };

struct ChannelGroup {
  std::string name;   // "albedo", or the full name of a single channel
  std::size_t first;  // its channels are first .. first + count - 1
  std::size_t count;  // 3 or 1
  Encoding encoding;
};

std::vector<ChannelGroup> channel_groups(const solidtex::texture& texture);

}  // namespace solidtex::tools
