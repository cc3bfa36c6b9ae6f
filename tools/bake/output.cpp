#include "tools/bake/output.h"

#include <Imath/half.h>
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <sstream>
#include <stdexcept>

#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

namespace fs = std::filesystem;

#ifdef SOLIDTEX_HAS_OPENVDB
constexpr bool has_openvdb = true;
#else
constexpr bool has_openvdb = false;
#endif

#ifdef SOLIDTEX_HAS_NANOVDB
constexpr bool has_nanovdb = true;
#else
constexpr bool has_nanovdb = false;
#endif

constexpr Format all_formats[] = {
    {FormatKind::npy, "npy", ".npy", "float 8 16 half", "", ColorSpace::model},
    {FormatKind::vdb, "vdb", ".vdb", "float half", "", ColorSpace::model},
    {FormatKind::nanovdb, "nanovdb", ".nvdb", "float", "", ColorSpace::model},
    {FormatKind::nrrd, "nrrd", ".nrrd", "float 8 16", "", ColorSpace::linear},
    {FormatKind::nhdr, "nhdr", ".nhdr", "float 8 16", "", ColorSpace::linear},
    {FormatKind::raw, "raw", ".raw", "float 8 16 half", "", ColorSpace::linear},
    {FormatKind::vti, "vti", ".vti", "float 8 16", "", ColorSpace::linear},
    {FormatKind::mitsuba, "vol", ".vol", "float", "1 3 6", ColorSpace::linear},
    {FormatKind::tiff, "tiff", ".tif", "16 8 half float", "", ColorSpace::linear},
    {FormatKind::imagej, "imagej", ".tif", "16 8 float", "", ColorSpace::linear},
    {FormatKind::dds, "dds", ".dds", "8 16 half float bc7", "1 2 3 4", ColorSpace::linear},
    {FormatKind::ktx2, "ktx2", ".ktx2", "8 16 half float bc7", "1 2 3 4", ColorSpace::linear},
    {FormatKind::flipbook, "flipbook", ".png", "8 16", "1 3", ColorSpace::srgb},
    {FormatKind::zarr, "zarr", ".zarr", "float half 16 8", "", ColorSpace::model},
    {FormatKind::png, "png", "", "8 16", "", ColorSpace::srgb},
    {FormatKind::exr, "exr", "", "float half", "", ColorSpace::linear},
};

template <class Accept>
std::string format_list(const char* separator, const Accept& text_of) {
  std::string list, last;
  for (const Format& format : all_formats) {
    const std::string text = text_of(format);
    if (text.empty() || text == last) continue;  // two formats are .tif
    list += (list.empty() ? "" : separator) + text;
    last = text;
  }
  return list;
}

const Format* find_format(const std::string& name) {
  const auto found =
      std::ranges::find_if(all_formats, [&](const Format& format) { return name == format.name; });
  return found == std::end(all_formats) ? nullptr : found;
}

// TIFF has two extensions.
std::string usual_extension(const fs::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".tiff" ? ".tif" : extension;
}

const Format& format_by_extension(const fs::path& path) {
  const std::string extension = usual_extension(path);
  const auto found = std::ranges::find_if(
      all_formats, [&](const Format& format) { return extension == format.extension; });
  if (!extension.empty() && found != std::end(all_formats)) return *found;
  throw std::runtime_error(fmt::format(
      "-o {}: expected a name that ends in {}, or --slices png|exr for a folder of images",
      path.string(), format_list(", ", [](const Format& format) { return format.extension; })));
}

// The channels phase.*, in their order.
std::vector<std::size_t> phase_channels(const solidtex::texture& texture) {
  std::vector<std::size_t> phases;
  std::vector<std::string> names;
  for (std::size_t channel = 0; channel < texture.channel_count(); ++channel) {
    names.push_back(texture.channel_name(channel));
    if (names.back().starts_with("phase.")) phases.push_back(channel);
  }
  if (phases.size() >= 2) return phases;
  throw std::runtime_error(
      fmt::format("--labels: {} has the channels {}, expected two or more phase.* as a model of "
                  "solidtex-train --phases has",
                  texture.name(), fmt::join(names, ", ")));
}

// A mean of labels is no label, and graphics formats show labels as black.
bool holds_labels(FormatKind kind) {
  switch (kind) {
    case FormatKind::npy:
    case FormatKind::nrrd:
    case FormatKind::nhdr:
    case FormatKind::raw:
    case FormatKind::vti:
    case FormatKind::tiff:
    case FormatKind::imagej:
    case FormatKind::png:
      return true;
    default:
      return false;
  }
}

void check_holds_labels(const Format& format, const fs::path& path) {
  if (holds_labels(format.kind)) return;
  const std::string extensions = format_list(
      ", ", [](const Format& other) { return holds_labels(other.kind) ? other.extension : ""; });
  throw std::runtime_error(
      fmt::format("--labels: found it with -o {}, expected a format of whole numbers: {}, or "
                  "--slices png",
                  path.string(), extensions));
}

std::vector<std::string> words(const char* text) {
  std::istringstream stream(text);
  return {std::istream_iterator<std::string>(stream), {}};
}

// Returns the name of a depth that the format has.
std::string depth_name(const Format& format, const std::string& text) {
  const std::vector<std::string> allowed = words(format.depths);
  std::string name = text.empty() ? allowed.front() : text;
  if (std::ranges::find(allowed, name) == allowed.end()) {
    throw std::runtime_error(
        fmt::format("--depth {}: {} holds {}", name, format.name, fmt::join(allowed, ", ")));
  }
  return name;
}

Depth parse_depth(const std::string& name) {
  if (name == "8" || name == "bc7") return Depth::uint8;
  if (name == "16") return Depth::uint16;
  return name == "half" ? Depth::half : Depth::float32;
}

bool is_integer(Depth depth) { return depth == Depth::uint8 || depth == Depth::uint16; }

ColorSpace parse_color_space(const Format& format, Depth depth, const std::string& text) {
  if (text == "model") return ColorSpace::model;
  if (text == "srgb") return ColorSpace::srgb;
  if (text == "linear") return ColorSpace::linear;
  // Graphics cards decode sRGB from 8 bits only.
  const bool is_texture = format.kind == FormatKind::dds || format.kind == FormatKind::ktx2;
  const bool is_encoded = is_texture ? depth == Depth::uint8 : is_integer(depth);
  return is_encoded ? ColorSpace::srgb : format.float_colors;
}

constexpr std::pair<const char*, double> units[] = {{"nm", 1e-3},  {"um", 1},     {"mm", 1e3},
                                                    {"cm", 1e4},   {"m", 1e6},    {"km", 1e9},
                                                    {"in", 25400}, {"ft", 304800}};

// Formats whose readers take the first three channels for a color.
bool begins_with_color(FormatKind kind) {
  return kind == FormatKind::dds || kind == FormatKind::ktx2 || kind == FormatKind::tiff;
}

}  // namespace

std::span<const Format> formats() { return all_formats; }

std::string format_name(const std::string& text) {
  if (find_format(text)) return text;
  const auto found = std::ranges::find_if(
      all_formats, [&](const Format& format) { return "." + text == format.extension; });
  return found == std::end(all_formats) ? text : found->name;
}

double VoxelSize::micrometers(std::size_t axis) const {
  const auto found = std::ranges::find_if(units, [&](const auto& u) { return unit == u.first; });
  return edges[axis] * (found == std::end(units) ? 1 : found->second);
}

VoxelSize parse_voxel_size(const std::string& text) {
  const auto fail = [&] {
    throw std::runtime_error(fmt::format(
        "--voxel-size: found {}, expected a length or X,Y,Z with one unit, 2.25um or 1,1,2mm "
        "(nm, um, mm, cm, m, km, in, ft)",
        text));
  };
  std::vector<double> edges;
  VoxelSize size;
  const char* at = text.data();
  const char* const end = at + text.size();
  while (true) {  // a number, and a unit: of the last one, or the same of all
    double edge = 0;
    const auto [next, error] = std::from_chars(at, end, edge);
    if (error != std::errc() || !(edge > 0) || !std::isfinite(edge)) fail();
    edges.push_back(edge);
    at = std::find(next, end, ',');
    const std::string unit(next, at);
    if (!size.unit.empty() && unit != size.unit) fail();
    size.unit = unit;
    if (at == end) break;
    ++at;
  }
  if (size.unit == "µm" || size.unit == "μm") size.unit = "um";  // U+00B5, U+03BC
  const bool known =
      std::ranges::any_of(units, [&](const auto& u) { return size.unit == u.first; });
  if (!known || (edges.size() != 1 && edges.size() != 3)) fail();
  if (edges.size() == 1) edges.assign(3, edges[0]);
  std::ranges::copy(edges, size.edges.begin());
  return size;
}

std::size_t bytes_per_value(Depth depth) {
  return depth == Depth::uint8 ? 1 : depth == Depth::float32 ? 4 : 2;
}

Encoding Output::encoding(const ChannelGroup& group) const {
  if (group.encoding == Encoding::data || color_space == ColorSpace::model) return group.encoding;
  return color_space == ColorSpace::srgb ? Encoding::srgb : Encoding::linear;
}

std::array<double, 3> Output::first_center(const Volume& volume) const {
  std::array<double, 3> center{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    center[axis] = (static_cast<double>(volume.origin[axis]) + 0.5) * voxel_size.edges[axis];
  return center;
}

const Format& format_of(const OutputRequest& request) {
  const std::string output = "-o " + request.path.string();
  const Format* format =
      request.format.empty() ? &format_by_extension(request.path) : find_format(request.format);
  if (!format) {
    throw std::runtime_error(
        fmt::format("--format {}: expected {}", request.format,
                    format_list(", ", [](const Format& candidate) { return candidate.name; })));
  }
  const auto needs = [&](const char* library, const char* package) {
    throw std::runtime_error(
        fmt::format("{}: this solidtex-bake was built without {} and cannot write {} (install {}, "
                    "configure with SOLIDTEX_WITH_OPENVDB=ON)",
                    output, library, format->extension, package));
  };
  if (format->kind == FormatKind::vdb && !has_openvdb) needs("OpenVDB", "libopenvdb-dev");
  if (format->kind == FormatKind::nanovdb && !has_nanovdb)
    needs("NanoVDB", "libopenvdb-dev and libnanovdb-dev");
  const std::string extension = usual_extension(request.path);
  const bool names_a_file = std::ranges::any_of(all_formats, [&](const Format& candidate) {
    return !extension.empty() && extension == candidate.extension;
  });
  if (!*format->extension && names_a_file) {
    throw std::runtime_error(
        fmt::format("{}: --format {} and --slices write a folder of images, not a {} file", output,
                    format->name, extension));
  }
  if (*format->extension && extension != format->extension) {
    throw std::runtime_error(fmt::format("{}: expected a name that ends in {} with --format {}",
                                         output, format->extension, format->name));
  }
  return *format;
}

Output resolve_output(const OutputRequest& request, const solidtex::texture& texture) {
  const Format& format = format_of(request);
  if (request.is_labels) check_holds_labels(format, request.path);
  const std::string depth_text = depth_name(format, request.is_labels ? "8" : request.depth);
  const Depth depth = parse_depth(depth_text);
  Output output{format,
                request.path,
                depth,
                depth_text == "bc7",
                parse_color_space(format, depth, request.color_space),
                request.voxel_size,
                {},
                {},
                {},
                {}};
  if (request.is_labels) {
    output.phases = phase_channels(texture);
    output.groups = {{"label", {output.phases.front()}, Encoding::data}};
  } else if (request.channels.empty()) {
    output.groups = channel_groups(texture);
  } else {
    output.groups = {channel_group(texture, request.channels, "--channels")};
  }
  if (begins_with_color(format.kind))
    std::stable_partition(output.groups.begin(), output.groups.end(),
                          [](const ChannelGroup& group) { return group.channels.size() == 3; });
  for (const ChannelGroup& group : output.groups)
    for (const std::size_t channel : group.channels) output.channels.push_back(channel);
  if (format.kind == FormatKind::npy) std::ranges::sort(output.channels);
  for (const std::size_t channel : output.channels)
    output.names.push_back(request.is_labels ? "label" : texture.channel_name(channel));
  const std::vector<std::string> counts = words(format.channel_counts);
  const std::string count = std::to_string(output.channels.size());
  if (!counts.empty() && std::ranges::find(counts, count) == counts.end()) {
    throw std::runtime_error(
        fmt::format("-o {}: {} holds {} channels, found {}: {}; choose some with --channels NAME",
                    request.path.string(), format.name, fmt::join(counts, " or "), count,
                    fmt::join(output.names, ", ")));
  }
  if (output.is_bc7 && output.channels.size() < 3) {
    throw std::runtime_error("--depth bc7: expected 3 or 4 channels, found " + count +
                             "; --depth 8 takes as many bytes for one");
  }
  return output;
}

bool can_be_smaller(const Output& output) {
  const std::vector<std::string> depths = words(output.format.depths);
  return output.depth != Depth::uint8 && std::ranges::find(depths, "8") != depths.end();
}

std::vector<fs::path> companions(const OutputRequest& request) {
  fs::path beside = request.path;
  switch (format_of(request).kind) {
    case FormatKind::nhdr:
      return {beside.replace_extension(".raw")};
    case FormatKind::flipbook:
      return {beside.replace_extension(".json")};
    default:
      return {};
  }
}

const char* encoding_name(Encoding encoding) {
  constexpr const char* names[] = {"srgb", "linear", "data"};
  return names[static_cast<int>(encoding)];
}

std::vector<float> with_labels(std::span<const float> voxels, std::size_t channels,
                               std::span<const std::size_t> phases) {
  std::vector<float> values(voxels.begin(), voxels.end());
  for (std::size_t first = 0; first < values.size(); first += channels) {
    std::size_t label = 0;
    for (std::size_t i = 1; i < phases.size(); ++i)
      if (voxels[first + phases[i]] > voxels[first + phases[label]]) label = i;
    values[first + phases[0]] = static_cast<float>(label) / 255;
  }
  return values;
}

VoxelEncoder::VoxelEncoder(const Output& output, std::span<const std::size_t> channels)
    : VoxelEncoder(output, channels, output.depth) {}

VoxelEncoder::VoxelEncoder(const Output& output, std::span<const std::size_t> channels, Depth depth)
    : depth_(depth), bytes_per_value_(tools::bytes_per_value(depth)) {
  for (const std::size_t channel : channels) {
    for (const ChannelGroup& group : output.groups) {
      if (std::ranges::find(group.channels, channel) == group.channels.end()) continue;
      const Encoding to = output.encoding(group);
      const Curve curve = to == group.encoding   ? Curve::none
                          : to == Encoding::srgb ? Curve::to_srgb
                                                 : Curve::to_linear;
      conversions_.push_back({channel, curve});
    }
  }
}

float VoxelEncoder::convert(float value, Curve curve) {
  if (curve == Curve::none) return value;
  return curve == Curve::to_srgb ? linear_to_srgb(value) : srgb_to_linear(value);
}

void VoxelEncoder::encode(const float* voxels, std::size_t step, std::size_t count,
                          std::byte* bytes) const {
  const auto put = [&](const auto& quantize) {
    for (std::size_t i = 0; i < count; ++i, voxels += step) {
      for (const Conversion& conversion : conversions_) {
        const auto value = quantize(convert(voxels[conversion.channel], conversion.curve));
        std::memcpy(bytes, &value, sizeof value);
        bytes += sizeof value;
      }
    }
  };
  switch (depth_) {
    case Depth::uint8:
      return put([](float value) { return quantize<std::uint8_t>(value); });
    case Depth::uint16:
      return put([](float value) { return quantize<std::uint16_t>(value); });
    case Depth::half:
      return put([](float value) { return Imath::half(value).bits(); });
    case Depth::float32:
      return put([](float value) { return value; });
  }
}

}  // namespace solidtex::tools
