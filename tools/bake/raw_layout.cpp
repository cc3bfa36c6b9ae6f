#include "tools/bake/raw_layout.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include "tools/bake/description.h"

namespace solidtex::tools {
namespace {

template <class Value>
std::string bytes_of(const Value& value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

const char* nrrd_type(Depth depth) {
  if (depth == Depth::float32) return "float";
  return depth == Depth::uint8 ? "uint8" : "uint16";
}

const char* vtk_type(Depth depth) {
  if (depth == Depth::float32) return "Float32";
  return depth == Depth::uint8 ? "UInt8" : "UInt16";
}

std::string nrrd_header(const Output& output, const Volume& volume) {
  const auto& [dx, dy, dz] = output.voxel_size.edges;
  const auto& [x, y, z] = volume.size;
  const std::size_t channels = output.channels.size();
  const bool is_color = output.groups.size() == 1 && channels == 3;
  // Channels are an axis of their own, the fastest.
  const bool has_channels = channels > 1;
  std::string text = "NRRD0005\n";
  text += fmt::format("type: {}\n", nrrd_type(output.depth));
  text += fmt::format("dimension: {}\n", has_channels ? 4 : 3);
  text += "space dimension: 3\nsizes: ";
  if (has_channels) text += fmt::format("{} ", channels);
  text += fmt::format("{} {} {}\nspace directions: {}", x, y, z, has_channels ? "none " : "");
  text += fmt::format("({},0,0) (0,{},0) (0,0,{})\n", dx, dy, dz);
  text += fmt::format("space origin: ({})\n", fmt::join(output.first_center(volume), ","));
  if (const std::string& unit = output.voxel_size.unit; !unit.empty())
    text += fmt::format("space units: \"{0}\" \"{0}\" \"{0}\"\n", unit);
  if (has_channels) text += is_color ? "kinds: RGB-color" : "kinds: vector";
  text += has_channels ? " domain domain domain\n" : "kinds: domain domain domain\n";
  text += fmt::format("endian: little\nencoding: raw\n");
  if (output.format.kind == FormatKind::nhdr)
    text += fmt::format(
        "data file: {}\n",
        std::filesystem::path(output.path).replace_extension(".raw").filename().string());
  for (const auto& [key, value] : description_fields(output, volume))
    text += fmt::format("{}:={}\n", key, value);
  return text + "\n";
}

// A string is the numbers of its bytes and a zero.
std::string vtk_string(const std::string& name, const std::string& value) {
  std::string text = fmt::format(
      "<Array type=\"String\" Name=\"{}\" NumberOfTuples=\"1\" format=\"ascii\">", xml_text(name));
  for (const unsigned char letter : value) text += fmt::format("{} ", letter);
  return text + "0</Array>\n";
}

}  // namespace

std::string xml_text(const std::string& text) {
  std::string escaped;
  for (const char letter : text) {
    switch (letter) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += letter;
    }
  }
  return escaped;
}

std::uint64_t RawLayout::add_block(const Output& output, const Volume& volume,
                                   std::vector<std::size_t> channels, std::uint64_t offset) {
  const std::uint64_t slice = static_cast<std::uint64_t>(volume.size[0] * volume.size[1]) *
                              channels.size() * output.bytes_per_value();
  blocks.push_back({std::move(channels), offset, slice});
  return offset + slice * static_cast<std::uint64_t>(volume.size[2]);
}

RawLayout nrrd_layout(const Output& output, const Volume& volume) {
  RawLayout layout;
  const std::string header = nrrd_header(output, volume);
  if (output.format.kind == FormatKind::nhdr) {
    layout.header = header;
    layout.add_block(output, volume, output.channels, 0);
  } else {
    layout.texts = {{0, header}};
    layout.add_block(output, volume, output.channels, header.size());
  }
  return layout;
}

RawLayout plain_layout(const Output& output, const Volume& volume) {
  RawLayout layout;
  layout.add_block(output, volume, output.channels, 0);
  return layout;
}

RawLayout vti_layout(const Output& output, const Volume& volume) {
  const auto& [x, y, z] = volume.size;
  const std::string extent = fmt::format("0 {} 0 {} 0 {}", x - 1, y - 1, z - 1);
  std::string text = fmt::format(
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n"
      "<ImageData WholeExtent=\"{}\" Origin=\"{}\" Spacing=\"{}\">\n<FieldData>\n",
      extent, fmt::join(output.first_center(volume), " "), fmt::join(output.voxel_size.edges, " "));
  for (const auto& [key, value] : description_fields(output, volume))
    text += vtk_string(key, value);
  text += fmt::format("</FieldData>\n<Piece Extent=\"{}\">\n<PointData Scalars=\"{}\">\n", extent,
                      xml_text(output.groups.front().name));
  // Each array begins with its number of bytes; offsets count from the underscore.
  RawLayout layout;
  std::uint64_t end = 0;
  for (const ChannelGroup& group : output.groups) {
    text += fmt::format(
        "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" "
        "offset=\"{}\"/>\n",
        vtk_type(output.depth), xml_text(group.name), group.channels.size(), end);
    const std::uint64_t begin = end + sizeof begin;
    end = layout.add_block(output, volume, group.channels, begin);
    layout.texts.push_back({begin - sizeof begin, bytes_of(end - begin)});
  }
  text += "</PointData>\n</Piece>\n</ImageData>\n<AppendedData encoding=\"raw\">\n_";
  for (RawBlock& block : layout.blocks) block.offset += text.size();
  for (RawText& length : layout.texts) length.offset += text.size();
  layout.texts.push_back({text.size() + end, "\n</AppendedData>\n</VTKFile>\n"});
  layout.texts.push_back({0, std::move(text)});
  return layout;
}

RawLayout mitsuba_layout(const Output& output, const Volume& volume) {
  constexpr char version = 3;
  constexpr std::int32_t float_type = 1;
  std::string header = std::string("VOL") + version + bytes_of(float_type);
  for (const std::int64_t edge : volume.size) header += bytes_of(static_cast<std::int32_t>(edge));
  header += bytes_of(static_cast<std::int32_t>(output.channels.size()));
  // The box in world units: lower corner, upper corner.
  for (const bool upper : {false, true}) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t corner = volume.origin[axis] + (upper ? volume.size[axis] : 0);
      header +=
          bytes_of(static_cast<float>(static_cast<double>(corner) * output.voxel_size.edges[axis]));
    }
  }
  RawLayout layout;
  layout.add_block(output, volume, output.channels, header.size());
  layout.texts = {{0, std::move(header)}};
  return layout;
}

}  // namespace solidtex::tools
