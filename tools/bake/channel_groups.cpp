#include "tools/bake/channel_groups.h"

namespace solidtex::tools {
namespace {

std::string prefix(const std::string& name) {
  const auto dot = name.rfind('.');
  return dot == std::string::npos ? std::string() : name.substr(0, dot);
}

// The file's colour space is that of albedo; all other channels are plain data.
Encoding encoding_of(const std::string& channel, const std::string& color_space) {
  if (prefix(channel) != "albedo") return Encoding::data;
  if (color_space == "srgb") return Encoding::srgb;
  return color_space == "linear" ? Encoding::linear : Encoding::data;
}

}  // namespace

std::vector<ChannelGroup> channel_groups(const solidtex::texture& texture) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < texture.channel_count(); ++i)
    names.push_back(texture.channel_name(i));
  const std::string color_space = texture.color_space();

  std::vector<ChannelGroup> groups;
  for (std::size_t first = 0; first < names.size();) {
    const std::string group = prefix(names[first]);
    std::size_t end = first + 1;
    while (!group.empty() && end < names.size() && prefix(names[end]) == group) ++end;
    const Encoding encoding = encoding_of(names[first], color_space);
    if (end - first == 3) {
      groups.push_back({group, first, 3, encoding});
    } else {
      for (std::size_t i = first; i < end; ++i) groups.push_back({names[i], i, 1, encoding});
    }
    first = end;
  }
  return groups;
}

}  // namespace solidtex::tools
