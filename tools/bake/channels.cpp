#include "tools/bake/channels.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace solidtex::tools {
namespace {

// Maps that people train, of the names that a model may lack.
constexpr const char* learned_maps[] = {"height", "metallic", "metalness", "roughness", "specular"};

std::string prefix(const std::string& name) {
  const auto dot = name.rfind('.');
  return dot == std::string::npos ? std::string() : name.substr(0, dot);
}

// The color space of the file is that of albedo; all other channels are plain data.
Encoding encoding_of(const std::string& channel, const std::string& color_space) {
  if (prefix(channel) != "albedo") return Encoding::data;
  if (color_space == "srgb") return Encoding::srgb;
  return color_space == "linear" ? Encoding::linear : Encoding::data;
}

// Indices of PREFIX.r, PREFIX.g and PREFIX.b; empty unless all three exist.
std::vector<std::size_t> color_channels(const std::vector<std::string>& names,
                                        const std::string& prefix) {
  std::vector<std::size_t> channels;
  for (const char* part : {".r", ".g", ".b"}) {
    const auto found = std::ranges::find(names, prefix + part);
    if (found == names.end()) return {};
    channels.push_back(static_cast<std::size_t>(found - names.begin()));
  }
  return channels;
}

std::vector<std::string> channel_names(const solidtex::texture& texture) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < texture.channel_count(); ++i)
    names.push_back(texture.channel_name(i));
  return names;
}

}  // namespace

std::vector<ChannelGroup> channel_groups(const solidtex::texture& texture) {
  const std::vector<std::string> names = channel_names(texture);
  const std::string color_space = texture.color_space();

  std::vector<ChannelGroup> groups;
  std::vector<bool> grouped(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (grouped[i]) continue;
    const Encoding encoding = encoding_of(names[i], color_space);
    if (const auto color = color_channels(names, prefix(names[i]));
        std::ranges::find(color, i) != color.end()) {
      groups.push_back({prefix(names[i]), color, encoding});
      for (const std::size_t channel : color) grouped[channel] = true;
    } else {
      groups.push_back({names[i], {i}, encoding});
    }
  }
  return groups;
}

ChannelGroup channel_group(const solidtex::texture& texture, const std::string& name,
                           const std::string& option) {
  const std::vector<ChannelGroup> groups = channel_groups(texture);
  std::string names;
  for (const ChannelGroup& group : groups) {
    if (group.name == (name.empty() ? "albedo" : name)) return group;
    names += (names.empty() ? "" : ", ") + group.name;
  }
  if (name.empty()) return groups[0];
  const bool is_map = std::ranges::find(learned_maps, name) != std::end(learned_maps);
  throw std::runtime_error(option + " " + name + ": " + texture.path() + " has " + names +
                           (is_map ? "; solidtex-train --map or --estimate adds channels" : ""));
}

std::vector<Encoding> channel_encodings(const solidtex::texture& texture) {
  std::vector<Encoding> encodings(texture.channel_count());
  for (const ChannelGroup& group : channel_groups(texture))
    for (const std::size_t channel : group.channels) encodings[channel] = group.encoding;
  return encodings;
}

void check_values(const solidtex::texture& texture, std::span<const float> values) {
  const auto bad = std::ranges::find_if_not(values, [](float v) { return std::isfinite(v); });
  if (bad == values.end()) return;
  const auto channel = static_cast<std::size_t>(bad - values.begin()) % texture.channel_count();
  throw std::runtime_error(texture.path() + ": channel " + texture.channel_name(channel) +
                           ": found the value " + std::to_string(*bad) +
                           ", expected a finite one: the model is damaged");
}

std::vector<std::string> exr_names(const solidtex::texture& texture) {
  std::vector<std::string> names = channel_names(texture);
  for (const ChannelGroup& group : channel_groups(texture)) {
    if (group.name != "albedo" || group.channels.size() != 3) continue;
    for (std::size_t i = 0; i < 3; ++i) names[group.channels[i]] = std::string(1, "RGB"[i]);
  }
  return names;
}

}  // namespace solidtex::tools
