#include "tools/bake/description.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

namespace solidtex::tools {

Fields description_fields(const Output& output, const Volume& volume) {
  Fields fields{{"solidtex_model", volume.texture.name()},
                {"solidtex_seed", std::to_string(volume.texture.seed())},
                {"solidtex_precision", volume.texture.precision()},
                {"solidtex_channels", fmt::format("{}", fmt::join(output.names, " "))}};
  for (const ChannelGroup& group : output.groups)
    fields.emplace_back("solidtex_encoding_" + group.name, encoding_name(output.encoding(group)));
  if (!output.phases.empty()) {
    std::vector<std::string> phases;
    for (const std::size_t channel : output.phases)
      phases.push_back(volume.texture.channel_name(channel));
    fields.emplace_back("solidtex_labels", fmt::format("{}", fmt::join(phases, " ")));
  }
  if (!output.voxel_size.unit.empty()) fields.emplace_back("unit", output.voxel_size.unit);
  return fields;
}

Fields placed_fields(const Output& output, const Volume& volume) {
  Fields fields = description_fields(output, volume);
  fields.emplace_back("solidtex_voxel_size",
                      fmt::format("{}", fmt::join(output.voxel_size.edges, " ")));
  fields.emplace_back("solidtex_position",
                      fmt::format("{}", fmt::join(output.first_center(volume), " ")));
  return fields;
}

std::string lines_of(const Fields& fields) {
  std::string text;
  for (const auto& [key, value] : fields) text += fmt::format("{}={}\n", key, value);
  return text;
}

}  // namespace solidtex::tools
