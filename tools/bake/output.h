// The file or folder to write: its format, the type of its values, its colors and its scale.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tools/bake/channels.h"
#include "tools/bake/volume.h"

namespace solidtex::tools {

// Type of a value in a file. uint8 and uint16 are integers whose largest value means 1; values
// are clamped to [0, 1].
enum class Depth { uint8, uint16, half, float32 };

std::size_t bytes_per_value(Depth depth);

// Encoding of colors in a file. `model`: the model's own.
enum class ColorSpace { model, srgb, linear };

enum class FormatKind {
  npy,
  vdb,
  nanovdb,
  nrrd,
  nhdr,
  raw,
  vti,
  mitsuba,
  tiff,
  imagej,
  dds,
  ktx2,
  flipbook,
  png,
  exr,
  zarr
};

struct Format {
  FormatKind kind;
  const char* name;            // of --format
  const char* extension;       // empty: a folder
  const char* depths;          // "8 16 half float", the default first
  const char* channel_counts;  // "1 3 6", or empty: any
  ColorSpace float_colors;     // encoding of half and float colors; integers are sRGB-encoded
};

// All formats of this build.
std::span<const Format> formats();

// The name of a format, also for its extension: "tiff" for "tif".
std::string format_name(const std::string& text);

// Edges of a voxel in a unit of length. Without a unit, lengths are in texels.
struct VoxelSize {
  std::array<double, 3> edges{1, 1, 1};
  std::string unit;  // "um", "mm", ... or empty

  // A length along an axis in micrometers. There must be a unit.
  double micrometers(std::size_t axis) const;
};

// Parses "2.25um" or "1,1,2.5mm". Throws std::runtime_error.
VoxelSize parse_voxel_size(const std::string& text);

// The output as options ask for it.
struct OutputRequest {
  std::filesystem::path path;
  std::string format;       // name of a format; empty: by the extension of `path`
  std::string depth;        // "8", "16", "half", "float", "bc7"; empty: the format's default
  std::string color_space;  // empty: the format's default
  std::string channels;     // name of one channel group; empty: all
  VoxelSize voxel_size;
  bool is_labels = false;  // the number of the most probable phase instead of the channels
};

struct Output {
  const Format& format;
  std::filesystem::path path;
  Depth depth;
  bool is_bc7;  // blocks of 8 bits
  ColorSpace color_space;
  VoxelSize voxel_size;
  std::vector<ChannelGroup> groups;   // groups in the file
  std::vector<std::size_t> channels;  // indices of their channels in the model, in the file's order
  std::vector<std::string> names;     // names of these channels
  std::vector<std::size_t> phases;    // channels of the phases that labels number; empty: none

  std::size_t bytes_per_value() const { return tools::bytes_per_value(depth); }
  std::size_t bytes_per_voxel() const { return bytes_per_value() * channels.size(); }

  // The encoding of a group in the file.
  Encoding encoding(const ChannelGroup& group) const;

  // The center of the volume's first voxel, in the unit of voxel_size.
  std::array<double, 3> first_center(const Volume& volume) const;
};

// Returns the format of a request. Throws if --format and the extension contradict each other, or
// name a format that this build cannot write.
const Format& format_of(const OutputRequest& request);

// Throws if the format cannot hold what is asked for.
Output resolve_output(const OutputRequest& request, const solidtex::texture& texture);

// Whether --depth 8 makes the file smaller.
bool can_be_smaller(const Output& output);

// Files beside the output that belong to it: the voxels of an .nhdr, the description of a flipbook.
std::vector<std::filesystem::path> companions(const OutputRequest& request);

// "srgb", "linear" or "data"
const char* encoding_name(Encoding encoding);

// Returns voxels of `channels` floats with the label of each, the number of its most probable
// phase, in the first phase's channel, as a share of 255.
std::vector<float> with_labels(std::span<const float> voxels, std::size_t channels,
                               std::span<const std::size_t> phases);

// Encodes voxels of a piece for a file.
class VoxelEncoder {
 public:
  // Encodes these channels of the model, one after another, at the depth of the output or another.
  VoxelEncoder(const Output& output, std::span<const std::size_t> channels);
  VoxelEncoder(const Output& output, std::span<const std::size_t> channels, Depth depth);

  std::size_t bytes_per_voxel() const { return conversions_.size() * bytes_per_value_; }

  // Encodes `count` voxels; those of the piece are `step` floats apart.
  void encode(const float* voxels, std::size_t step, std::size_t count, std::byte* bytes) const;

 private:
  enum class Curve { none, to_srgb, to_linear };
  struct Conversion {
    std::size_t channel;
    Curve curve;
  };
  static float convert(float value, Curve curve);

  std::vector<Conversion> conversions_;
  Depth depth_;
  std::size_t bytes_per_value_;
};

}  // namespace solidtex::tools
