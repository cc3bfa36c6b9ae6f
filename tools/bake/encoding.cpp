#include "tools/bake/encoding.h"

namespace solidtex::tools {

std::vector<Encoding> channel_encodings(const solidtex::texture& texture) {
  std::vector<Encoding> encodings(texture.channel_count());
  for (const ChannelGroup& group : channel_groups(texture)) {
    for (const std::size_t channel : group.channels) encodings[channel] = group.encoding;
  }
  return encodings;
}

std::vector<std::string> exr_names(const solidtex::texture& texture) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < texture.channel_count(); ++i)
    names.push_back(texture.channel_name(i));
  for (const ChannelGroup& group : channel_groups(texture)) {
    if (group.name != "albedo" || group.channels.size() != 3) continue;
    for (std::size_t i = 0; i < 3; ++i) names[group.channels[i]] = std::string(1, "RGB"[i]);
  }
  return names;
}

}  // namespace solidtex::tools
