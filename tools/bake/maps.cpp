#include "tools/bake/maps.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <stdexcept>

#include "tools/bake/image_file.h"

namespace solidtex::tools {
namespace {

MapSet::Map normal_map(const solidtex::texture& texture) {
  for (const ChannelGroup& group : channel_groups(texture)) {
    if (group.name == "height") return {"normal", group.channels, Encoding::data, {}};
  }
  throw std::runtime_error("--maps normal: " + texture.path() +
                           " has no channel height, expected one to make normals of");
}

// The names that Substance writes, and that Blender and game engines recognize.
std::string name_in_files(const std::string& name) {
  if (name == "albedo") return "BaseColor";
  std::string result = name;
  result[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(result[0])));
  return result;
}

// Values as they are stored: integers from 0 to 1, or light and plain data for floats.
std::vector<float> stored(const MapSet::Map& map, bool is_exr, bool is_directx) {
  std::vector<float> values = map.values;
  if (map.is_normal()) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      const bool is_flipped = is_directx && i % 3 == 1;
      values[i] = 0.5f + (is_flipped ? -0.5f : 0.5f) * values[i];
    }
    return values;
  }
  for (float& value : values) {
    value = is_exr ? light_value(value, map.encoding) : display_value(value, map.encoding);
  }
  return values;
}

template <class Integer>
void write_integers(const std::filesystem::path& file, int size, const MapSet::Map& map,
                    const std::vector<float>& values) {
  std::vector<Integer> pixels(values.size());
  std::ranges::transform(values, pixels.begin(), quantize<Integer>);
  const bool is_data = map.encoding == Encoding::data;
  write_png(file,
            {size, size, static_cast<int>(map.components()), sizeof(Integer) == 2,
             is_data ? Encoding::data : Encoding::srgb},
            std::as_bytes(std::span(pixels)));
}

}  // namespace

MapSet::MapSet(const solidtex::texture& texture, const std::vector<std::string>& names, int size)
    : size_(size) {
  std::vector<std::string> wanted = names;
  if (wanted.empty()) {
    for (const ChannelGroup& group : channel_groups(texture)) wanted.push_back(group.name);
    if (std::ranges::count(wanted, "height") > 0) wanted.emplace_back("normal");
  }
  for (const std::string& name : wanted) {
    if (find(name)) continue;
    if (name == "normal") {
      maps_.push_back(normal_map(texture));
    } else {
      const ChannelGroup group = channel_group(texture, name, "--maps");
      if (group.name.find_first_of("/\\") != std::string::npos)
        throw std::runtime_error("--maps: " + texture.path() + ": found the channel \"" +
                                 group.name + "\", expected a name without slashes, for a file");
      maps_.push_back({group.name, group.channels, group.encoding, {}});
    }
  }
}

std::size_t MapSet::bytes() const {
  std::size_t components = 0, largest = 0;
  for (const Map& map : maps_) {
    components += map.components();
    largest = std::max(largest, map.components());
  }
  // Besides the values, one map is held as floats, as integers and as a file while it is written.
  const auto texels = static_cast<std::size_t>(size_) * static_cast<std::size_t>(size_);
  return texels * sizeof(float) * (components + 2 * largest);
}

const MapSet::Map* MapSet::find(const std::string& name) const {
  const auto found = std::ranges::find(maps_, name, &Map::name);
  return found == maps_.end() ? nullptr : &*found;
}

void MapSet::evaluate(const mesh::Atlas& atlas, const solidtex::texture& texture,
                      const mesh::AtlasRegion& band, double depth) {
  const std::size_t channels = texture.channel_count();
  const std::size_t texels =
      static_cast<std::size_t>(band.width()) * static_cast<std::size_t>(band.height());
  std::vector<float> values(texels * channels);
  if (std::ranges::any_of(maps_, [](const Map& map) { return !map.is_normal(); })) {
    atlas.evaluate(texture, band, values.data());
    check_values(texture, values);
  }
  for (Map& map : maps_) {
    if (map.is_normal()) {
      const std::size_t first = map.values.size();
      map.values.resize(first + 3 * texels);
      atlas.evaluate_normals(texture, band, map.channels[0], depth, &map.values[first]);
      continue;
    }
    for (std::size_t texel = 0; texel < texels; ++texel) {
      for (const std::size_t channel : map.channels) {
        map.values.push_back(values[texel * channels + channel]);
      }
    }
  }
}

void MapSet::write(const std::filesystem::path& folder, const std::string& stem, bool is_exr,
                   bool is_directx) const {
  for (const Map& map : maps_) {
    const std::string name = stem + "_" + name_in_files(map.name) + (is_exr ? ".exr" : ".png");
    const std::vector<float> values = stored(map, is_exr, is_directx);
    if (is_exr) {
      const std::vector<std::string> rgb{"R", "G", "B"}, gray{"Y"};
      ExrFile file(folder / name, size_, size_, map.components() == 3 ? rgb : gray,
                   map.encoding == Encoding::data ? Encoding::data : Encoding::linear);
      file.write_rows(values.data(), size_);
      file.close();
    } else if (map.is_normal() || map.name == "height") {
      write_integers<std::uint16_t>(folder / name, size_, map, values);
    } else {
      write_integers<std::uint8_t>(folder / name, size_, map, values);
    }
  }
}

}  // namespace solidtex::tools
