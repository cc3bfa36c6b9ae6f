#include "tools/bake/zarr/store.h"

#include <fmt/core.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>

#include "tools/bake/channels.h"
#include "tools/bake/zarr/chunk.h"
#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr char metadata_name[] = "zarr.json";
constexpr char identity_key[] = "solidtex";

ordered_json named(const char* name, const ordered_json& configuration) {
  return {{"name", name}, {"configuration", configuration}};
}

ordered_json codecs_of(const Output& output, const StoreLayout& layout, int level) {
  const ordered_json bytes = named("bytes", {{"endian", "little"}}), crc32c = {{"name", "crc32c"}};
  const ordered_json blosc = named("blosc", {{"typesize", output.bytes_per_value()},
                                             {"cname", blosc_compressor},
                                             {"clevel", blosc_level},
                                             {"shuffle", blosc_shuffle},
                                             {"blocksize", 0}});
  const std::int64_t edge = layout.chunk_edge(level);
  return ordered_json::array(
      {named("sharding_indexed", {{"chunk_shape", {1, edge, edge, edge}},
                                  {"codecs", ordered_json::array({bytes, blosc, crc32c})},
                                  {"index_codecs", ordered_json::array({bytes, crc32c})},
                                  {"index_location", "end"}})});
}

ordered_json array_metadata(const Output& output, const StoreLayout& layout, int level) {
  const auto [x, y, z] = layout.level_size(level);
  const std::int64_t edge = layout.shard_edge_of(level);
  return {{"zarr_format", 3},
          {"node_type", "array"},
          {"shape", {layout.channels, z, y, x}},
          {"data_type", data_type(output.depth)},
          {"chunk_grid", named("regular", {{"chunk_shape", {layout.channels, edge, edge, edge}}})},
          {"chunk_key_encoding", named("default", {{"separator", "/"}})},
          {"fill_value", 0},
          {"codecs", codecs_of(output, layout, level)},
          {"attributes", ordered_json::object()},
          {"dimension_names", {"c", "z", "y", "x"}}};
}

// Coordinates are those of the centers of voxels.
ordered_json transformations(const Output& output, const Volume& volume, int level) {
  ordered_json scale = {1.0}, translation = {0.0};
  for (const std::size_t axis : {2, 1, 0}) {
    const double texels = static_cast<double>(std::int64_t{1} << level);
    const double edge = output.voxel_size.edges[axis];
    scale.push_back(texels * edge);
    translation.push_back((static_cast<double>(volume.origin[axis]) + texels / 2) * edge);
  }
  return ordered_json::array({{{"type", "scale"}, {"scale", scale}},
                              {{"type", "translation"}, {"translation", translation}}});
}

ordered_json channels_metadata(const Output& output, const Volume& volume) {
  ordered_json channels = ordered_json::array();
  std::vector<const char*> colors(volume.channels(), "FFFFFF");
  for (const ChannelGroup& group : output.groups) {
    constexpr const char* primaries[] = {"FF0000", "00FF00", "0000FF"};
    if (group.channels.size() != 3) continue;
    for (std::size_t i = 0; i < 3; ++i) colors[group.channels[i]] = primaries[i];
  }
  const int one = output.depth == Depth::uint8 ? 255 : output.depth == Depth::uint16 ? 65535 : 1;
  for (std::size_t i = 0; i < output.channels.size(); ++i) {
    channels.push_back({{"label", output.names[i]},
                        {"color", colors[output.channels[i]]},
                        {"active", true},
                        {"window", {{"min", 0}, {"max", one}, {"start", 0}, {"end", one}}}});
  }
  return channels;
}

ordered_json axes_metadata(const VoxelSize& voxel_size) {
  static const std::map<std::string, const char*> units = {
      {"nm", "nanometer"}, {"um", "micrometer"}, {"mm", "millimeter"}, {"cm", "centimeter"},
      {"m", "meter"},      {"km", "kilometer"},  {"in", "inch"},       {"ft", "foot"}};
  ordered_json axes = ordered_json::array({{{"name", "c"}, {"type", "channel"}}});
  for (const char* name : {"z", "y", "x"}) {
    axes.push_back({{"name", name}, {"type", "space"}});
    if (!voxel_size.unit.empty()) axes.back()["unit"] = units.at(voxel_size.unit);
  }
  return axes;
}

ordered_json group_metadata(const Output& output, const Volume& volume, const StoreLayout& layout,
                            const ordered_json& identity) {
  ordered_json datasets = ordered_json::array();
  for (int level = 0; level < layout.level_count(); ++level) {
    datasets.push_back({{"path", std::to_string(level)},
                        {"coordinateTransformations", transformations(output, volume, level)}});
  }
  const ordered_json image = {{"name", volume.texture.name()},
                              {"axes", axes_metadata(output.voxel_size)},
                              {"datasets", datasets},
                              {"type", "mean of light"}};
  const ordered_json ome = {{"version", "0.5"},
                            {"multiscales", ordered_json::array({image})},
                            {"omero", {{"channels", channels_metadata(output, volume)}}}};
  return {{"zarr_format", 3},
          {"node_type", "group"},
          {"attributes", {{"ome", ome}, {identity_key, identity}}}};
}

void write_metadata(const fs::path& file, const ordered_json& document) {
  AtomicFile atomic(file);
  OutputFile stream(atomic.temporary_path(), file);
  const std::string text = document.dump(2) + "\n";
  stream.write(0, text.data(), text.size());
  stream.sync();
  stream.close();
  try {
    atomic.commit();
  } catch (const std::runtime_error&) {
    if (!fs::exists(file)) throw;  // else another job of an array was first
  }
  sync_folder(file.parent_path());
}

ordered_json read_metadata(const fs::path& file, const char* remedy) {
  std::ifstream stream(file);
  if (!stream) throw std::runtime_error(file.string() + ": cannot read: " + std::strerror(errno));
  ordered_json document = ordered_json::parse(stream, nullptr, false);
  if (document.is_object()) return document;
  throw std::runtime_error(
      fmt::format("{}: found a damaged file, expected JSON; {}", file.string(), remedy));
}

[[noreturn]] void refuse(const fs::path& folder, const std::string& found,
                         const std::string& expected) {
  throw std::runtime_error(fmt::format("{}: found {}, expected {}; give another name",
                                       folder.string(), found, expected));
}

void check_identity(const fs::path& folder, const ordered_json& identity) {
  const ordered_json document = read_metadata(
      folder / metadata_name,
      "nothing else says what the folder holds: remove the folder, or copy the zarr.json here that "
      "the command of this bake begins in another folder");
  const auto attributes = document.value("attributes", ordered_json::object());
  const auto found = attributes.value(identity_key, ordered_json());
  if (!found.is_object()) refuse(folder, "a Zarr store of another program", "one of this program");
  for (const auto& [key, value] : identity.items()) {
    const ordered_json other = found.value(key, ordered_json());
    if (other == value) continue;
    if (key == "model")
      refuse(folder, "a bake of another model, or of this one before it was changed",
             "one of this model");
    refuse(folder, fmt::format("a bake with {} {}", key, other.dump()), value.dump());
  }
}

bool is_hidden(const fs::path& path) { return path.filename().string().starts_with("."); }

// A folder without metadata, where other jobs of an array may be writing it. Theirs is the same.
bool is_new(const fs::path& folder) {
  const fs::path metadata = folder / metadata_name;
  if (fs::exists(metadata)) return false;
  const bool is_empty = std::ranges::all_of(
      fs::directory_iterator(folder), [](const auto& entry) { return is_hidden(entry.path()); });
  if (fs::exists(metadata)) return false;
  if (!is_empty)
    refuse(folder, std::string("a folder without ") + metadata_name, "a Zarr store, or no folder");
  return true;
}

void check_array(const fs::path& folder, const fs::path& file, const ordered_json& expected) {
  const ordered_json found = read_metadata(file, "remove it, and it is made again");
  for (const auto& [key, value] : expected.items()) {
    const ordered_json other = found.value(key, ordered_json());
    if (other == value) continue;
    refuse(folder, fmt::format("other metadata in {}: {} {}", file.string(), key, other.dump()),
           value.dump());
  }
}

void complete_metadata(const fs::path& folder, const Output& output, const StoreLayout& layout) {
  for (int level = 0; level < layout.level_count(); ++level) {
    const fs::path file = folder / std::to_string(level) / metadata_name;
    const ordered_json expected = array_metadata(output, layout, level);
    if (fs::exists(file)) {
      check_array(folder, file, expected);
    } else {
      make_folders(file.parent_path());
      write_metadata(file, expected);
    }
    remove_abandoned(file);
  }
}

void create_folder(const fs::path& folder) {
  std::error_code problem;
  if (!fs::create_directory(folder, problem) && !fs::is_directory(folder)) {
    const bool exists = fs::exists(fs::symlink_status(folder));
    if (exists) refuse(folder, "a file", "a Zarr store, which is a folder");
    throw WriteError(folder, problem.message());
  }
}

}  // namespace

const char* data_type(Depth depth) {
  constexpr const char* names[] = {"uint8", "uint16", "float16", "float32"};
  return names[static_cast<int>(depth)];
}

void open_store(const fs::path& folder, const Output& output, const Volume& volume,
                const StoreLayout& layout, const ordered_json& identity) {
  create_folder(folder);
  try {
    if (is_new(folder)) {
      write_metadata(folder / metadata_name, group_metadata(output, volume, layout, identity));
    } else {
      check_identity(folder, identity);
    }
    // Not before the file has its name: jobs of an array write it at once, and a file is unlocked
    // for a moment after it is made.
    remove_abandoned(folder / metadata_name);
    complete_metadata(folder, output, layout);
  } catch (...) {
    std::error_code ignored;
    fs::remove(folder, ignored);  // only if it is empty
    throw;
  }
}

}  // namespace solidtex::tools
