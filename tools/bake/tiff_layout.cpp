#include <fmt/core.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "tools/bake/description.h"
#include "tools/bake/raw_layout.h"

namespace solidtex::tools {
namespace {

enum Type : std::uint16_t { ascii = 2, short_type = 3, long_type = 4, rational = 5, long8 = 16 };

template <class Value>
void append(std::string& bytes, Value value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string shorts(std::size_t count, std::uint16_t value) {
  std::string bytes;
  for (std::size_t i = 0; i < count; ++i) append(bytes, value);
  return bytes;
}

// A field of a page: its value, or where it lies.
struct Field {
  std::uint16_t tag, type;
  std::uint64_t count;
  std::string bytes;
};

// The directories of all pages, in one of the two versions of TIFF. What the pages share lies
// before them.
class Directories {
 public:
  explicit Directories(bool is_big) : is_big_(is_big) {
    append(bytes_, std::uint16_t{0x4949});  // little endian
    if (is_big_) {
      for (const int number : {43, 8, 0}) append(bytes_, static_cast<std::uint16_t>(number));
    } else {
      append(bytes_, std::uint16_t{42});
    }
    next_ = bytes_.size();
    append_offset(0);
  }

  // The field, with its value stored now where it does not fit into a directory.
  Field field(std::uint16_t tag, Type type, std::uint64_t count, const std::string& value) {
    Field result{tag, type, count, value};
    if (value.size() > offset_size()) {
      result.bytes.clear();
      append_to(result.bytes, bytes_.size());
      bytes_ += value;
      align();
    }
    result.bytes.resize(offset_size());
    return result;
  }
  Field number(std::uint16_t tag, std::uint64_t value) const {
    Field result{tag, is_big_ ? long8 : long_type, 1, {}};
    append_to(result.bytes, value);
    return result;
  }
  Field word(std::uint16_t tag, std::uint16_t value) {
    return field(tag, short_type, 1, shorts(1, value));
  }

  // Fields are in the order of their tags.
  void add_page(const std::vector<Field>& fields) {
    const std::uint64_t offset = bytes_.size();
    std::memcpy(&bytes_[next_], &offset, offset_size());
    if (is_big_) {
      append(bytes_, static_cast<std::uint64_t>(fields.size()));
    } else {
      append(bytes_, static_cast<std::uint16_t>(fields.size()));
    }
    for (const Field& field : fields) {
      append(bytes_, field.tag);
      append(bytes_, field.type);
      append_offset(field.count);
      bytes_ += field.bytes;
    }
    next_ = bytes_.size();
    append_offset(0);
    align();
  }

  std::string take() { return std::move(bytes_); }

  // Bytes of a page with this number of fields.
  std::size_t page_bytes(std::size_t fields) const {
    return is_big_ ? 8 + 20 * fields + 8 : (2 + 12 * fields + 4 + 7) / 8 * 8;
  }
  std::size_t size() const { return bytes_.size(); }
  void align() { bytes_.resize((bytes_.size() + 7) / 8 * 8); }

 private:
  std::size_t offset_size() const { return is_big_ ? 8 : 4; }
  void append_to(std::string& bytes, std::uint64_t value) const {
    bytes.append(reinterpret_cast<const char*>(&value), offset_size());
  }
  void append_offset(std::uint64_t value) { append_to(bytes_, value); }

  bool is_big_;
  std::string bytes_;
  std::size_t next_;  // where the offset of the next page goes
};

// Pixels in a unit, where a pixel has this edge in it: a fraction of 32-bit numbers, as exact as a
// power of ten above the line makes it.
std::string pixels_in_unit(double edge) {
  constexpr double largest = 4294967295.0;
  double numerator = 1e9;
  while (numerator > 1 && numerator * edge > largest) numerator /= 10;
  std::string bytes;
  append(bytes, static_cast<std::uint32_t>(numerator));
  append(bytes, static_cast<std::uint32_t>(std::clamp(numerator * edge + 0.5, 1.0, largest)));
  return bytes;
}

// Pixels in a centimeter, where the voxels have a size. The description has it exactly.
std::string resolution(const VoxelSize& size, std::size_t axis) {
  constexpr double um_in_cm = 1e4;
  return pixels_in_unit(size.unit.empty() ? 1 : size.micrometers(axis) / um_in_cm);
}

// ImageJ knows the edges along x and y from pixels in its unit alone.
std::string imagej_resolution(const VoxelSize& size, std::size_t axis) {
  constexpr double smallest = 1e-6, largest = 4e9;
  const double edge = size.edges[axis];
  if (edge >= smallest && edge <= largest) return pixels_in_unit(edge);
  throw std::runtime_error(
      fmt::format("--voxel-size: found an edge of {}{}, expected {} to {} of the unit in a TIFF of "
                  "ImageJ; take another unit",
                  edge, size.unit, smallest, largest));
}

// Without the unit, for which ImageJ and OME-XML have a place.
std::string description_lines(const Output& output, const Volume& volume) {
  Fields fields = description_fields(output, volume);
  std::erase_if(fields, [](const auto& field) { return field.first == "unit"; });
  return lines_of(fields);
}

// The value that ImageJ shows as white.
std::size_t largest_shown(const Output& output) {
  if (!output.phases.empty()) return output.phases.size() - 1;
  if (output.depth == Depth::uint8) return 255;
  return output.depth == Depth::uint16 ? 65535 : 1;
}

std::string imagej_description(const Output& output, const Volume& volume) {
  const std::size_t channels = output.channels.size();
  const auto slices = static_cast<std::size_t>(volume.size[2]);
  std::string text = fmt::format("ImageJ=1.54f\nimages={}\n", channels * slices);
  if (channels > 1) text += fmt::format("channels={}\n", channels);
  text += fmt::format("slices={}\nhyperstack=true\n", slices);
  if (channels > 1) text += "mode=composite\n";
  text += fmt::format("unit={}\nspacing={}\nloop=false\n",
                      output.voxel_size.unit.empty() ? "pixel" : output.voxel_size.unit,
                      output.voxel_size.edges[2]);
  constexpr const char* axes = "xyz";
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (volume.origin[axis] != 0)
      text += fmt::format("{}origin={}\n", axes[axis], -volume.origin[axis]);
  return text + fmt::format("min=0\nmax={}\n", largest_shown(output)) +
         description_lines(output, volume);
}

const char* ome_type(Depth depth) {
  if (depth == Depth::float32) return "float";
  return depth == Depth::uint8 ? "uint8" : "uint16";
}

// The center of the first voxel, as the position of the first page.
std::string ome_plane(const Output& output, const Volume& volume) {
  constexpr const char* axes = "XYZ";
  std::string text = "<Plane TheZ=\"0\" TheT=\"0\" TheC=\"0\"";
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double voxels = static_cast<double>(volume.origin[axis]) + 0.5;
    if (output.voxel_size.unit.empty())
      text += fmt::format(" Position{}=\"{}\"", axes[axis], voxels);
    else
      text += fmt::format(" Position{0}=\"{1}\" Position{0}Unit=\"\xC2\xB5m\"", axes[axis],
                          voxels * output.voxel_size.micrometers(axis));
  }
  return text + "/>";
}

// OME-XML has no type for half floats.
std::string ome_description(const Output& output, const Volume& volume) {
  const auto& [x, y, z] = volume.size;
  const std::size_t channels = output.channels.size();
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?><OME "
      "xmlns=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\"><Image "
      "ID=\"Image:0\"><Description>{}</Description><Pixels ID=\"Pixels:0\" "
      "DimensionOrder=\"XYCZT\" Type=\"{}\" BigEndian=\"false\" "
      "Interleaved=\"true\" SizeX=\"{}\" SizeY=\"{}\" SizeZ=\"{}\" SizeC=\"{}\" SizeT=\"1\"",
      xml_text(description_lines(output, volume)), ome_type(output.depth), x, y, z, channels);
  constexpr const char* axes = "XYZ";
  if (!output.voxel_size.unit.empty()) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      text += fmt::format(" PhysicalSize{0}=\"{1}\" PhysicalSize{0}Unit=\"\xC2\xB5m\"", axes[axis],
                          output.voxel_size.micrometers(axis));
  }
  return text + fmt::format(
                    "><Channel ID=\"Channel:0:0\" SamplesPerPixel=\"{}\"/><TiffData "
                    "IFD=\"0\" PlaneCount=\"{}\"/>{}</Pixels></Image></OME>",
                    channels, z, ome_plane(output, volume));
}

bool is_imagej(const Output& output) { return output.format.kind == FormatKind::imagej; }

std::string description(const Output& output, const Volume& volume) {
  if (is_imagej(output)) return imagej_description(output, volume);
  return output.depth == Depth::half ? lines_of(placed_fields(output, volume))
                                     : ome_description(output, volume);
}

// The pages of all slices follow the directories without a gap: ImageJ needs that.
RawLayout pages(const Output& output, const Volume& volume, bool is_big) {
  constexpr std::uint16_t kInteger = 1, kFloat = 3, kGray = 1, kColor = 2, kCentimeter = 3;
  const std::size_t samples = is_imagej(output) ? 1 : output.channels.size();
  const std::size_t planes = output.channels.size() / samples;
  const bool is_color = samples > 1 && output.groups.front().channels.size() == 3;
  const bool is_float = output.depth == Depth::half || output.depth == Depth::float32;
  const std::size_t extra = samples - (is_color ? 3 : 1);
  const auto width = static_cast<std::uint64_t>(volume.size[0]);
  const auto height = static_cast<std::uint64_t>(volume.size[1]);
  const auto slices = static_cast<std::uint64_t>(volume.size[2]);
  const std::uint64_t page_size = width * height * samples * output.bytes_per_value();

  Directories file(is_big);
  const auto bits = static_cast<std::uint16_t>(8 * output.bytes_per_value());
  const auto resolution_of = is_imagej(output) ? imagej_resolution : resolution;
  const bool has_unit = !is_imagej(output) && !output.voxel_size.unit.empty();
  std::vector<Field> fields{file.number(256, width),
                            file.number(257, height),
                            file.field(258, short_type, samples, shorts(samples, bits)),
                            file.word(259, 1),  // no compression
                            file.word(262, is_color ? kColor : kGray),
                            file.number(273, 0),  // the offset
                            file.word(277, static_cast<std::uint16_t>(samples)),
                            file.number(278, height),
                            file.number(279, page_size),
                            file.field(282, rational, 1, resolution_of(output.voxel_size, 0)),
                            file.field(283, rational, 1, resolution_of(output.voxel_size, 1)),
                            file.word(284, 1),  // channels are interleaved
                            file.word(296, has_unit ? kCentimeter : 1)};
  if (extra) fields.push_back(file.field(338, short_type, extra, shorts(extra, 0)));
  fields.push_back(
      file.field(339, short_type, samples, shorts(samples, is_float ? kFloat : kInteger)));
  constexpr std::size_t offset_field = 5;  // and the description goes before it

  std::vector<Field> first = fields;
  const std::string text = description(output, volume) + '\0';
  first.insert(first.begin() + offset_field, file.field(270, ascii, text.size(), text));
  file.align();
  const std::uint64_t page_count = slices * planes;
  const std::uint64_t directories = file.size() + file.page_bytes(first.size()) +
                                    (page_count - 1) * file.page_bytes(fields.size());
  for (std::uint64_t page = 0; page < page_count; ++page) {
    std::vector<Field>& of_page = page == 0 ? first : fields;
    of_page[page == 0 ? offset_field + 1 : offset_field] =
        file.number(273, directories + page * page_size);
    file.add_page(of_page);
  }

  RawLayout layout;
  if (is_imagej(output)) {
    for (std::size_t plane = 0; plane < planes; ++plane)
      layout.blocks.push_back(
          {{output.channels[plane]}, directories + plane * page_size, planes * page_size});
  } else {
    layout.add_block(output, volume, output.channels, directories);
  }
  layout.texts = {{0, file.take()}};
  return layout;
}

}  // namespace

RawLayout tiff_layout(const Output& output, const Volume& volume) {
  constexpr double max_classic = 4e9;
  const double bytes = static_cast<double>(voxel_count(volume.size) * output.bytes_per_voxel()) +
                       1000.0 * static_cast<double>(volume.size[2]);
  return pages(output, volume, bytes > max_classic);
}

}  // namespace solidtex::tools
