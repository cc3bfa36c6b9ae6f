#include "tools/bake/sink.h"

#include <fmt/core.h>

#include <algorithm>
#include <stdexcept>

#include "tools/common/limits.h"

namespace solidtex::tools {
namespace {

namespace fs = std::filesystem;

// Bytes of a value in a compressed file, less than any shipped model takes. A file that turns out
// larger ends with the error of a full disk.
constexpr double min_png_bytes = 0.25, min_exr_bytes = 3, min_vdb_bytes = 2;

// Of an .npy file: its dictionary is padded to this size.
constexpr double npy_header_bytes = 128;

constexpr char streams[] =
    ".zarr, .npy, .nrrd, .vti, .vol, .tif and .raw are written piece by piece, --slices png|exr "
    "slice by slice";
constexpr char stops[] = "a bake that fills it stops and leaves nothing";
constexpr char splits[] = "--slices png|exr writes smaller files";

// Options that take less on the disk.
std::string smaller(const Output& output) {
  return can_be_smaller(output) ? "--depth 8 and --slices png take less"
                                : "--slices png takes less";
}

// OpenVDB holds leaves of 8^3 voxels, each with a mask and a place in the tree.
double vdb_bytes(const Output& output, const Volume& volume) {
  constexpr double voxels = 8 * 8 * 8, overhead = 128;
  double leaves = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t first = volume.origin[axis] >> 3;
    const std::int64_t last = (volume.origin[axis] + volume.size[axis] - 1) >> 3;
    leaves *= static_cast<double>(last - first + 1);
  }
  const auto channels = static_cast<double>(output.channels.size());
  const auto grids = static_cast<double>(output.groups.size());
  return leaves * (voxels * channels * sizeof(float) + grids * overhead);
}

// Graphics cards have no texels of three channels.
double padded_channels(const Output& output) {
  return static_cast<double>(output.channels.size() == 3 ? 4 : output.channels.size());
}

// Texels of all levels of a 3D texture in a file.
double texture_bytes(const Output& output, Index3 size) {
  const double texel = padded_channels(output) * static_cast<double>(output.bytes_per_value());
  double bytes = 0;
  while (true) {
    const Index3 blocks{(size[0] + 3) / 4, (size[1] + 3) / 4, size[2]};
    bytes += output.is_bc7 ? 16.0 * static_cast<double>(voxel_count(blocks))
                           : texel * static_cast<double>(voxel_count(size));
    if (voxel_count(size) == 1) return bytes;
    for (std::int64_t& edge : size) edge = std::max(edge / 2, std::int64_t{1});
  }
}

// The largest piece; `block` as in check_room.
double piece_bytes(const Volume& volume, std::int64_t block) {
  double bytes = static_cast<double>(volume.channels() * sizeof(float));
  for (const std::int64_t edge : volume.size)
    bytes *= static_cast<double>(block ? std::min(edge, block) : edge);
  return block ? bytes : std::min(bytes, static_cast<double>(max_piece_bytes));
}

}  // namespace

void check_room(const Output& output, const Volume& volume, std::int64_t block) {
  const fs::path& path = output.path;
  const auto [x, y, z] = volume.size;
  const double slice_values =
      static_cast<double>(x) * static_cast<double>(y) * static_cast<double>(output.channels.size());
  const double values = slice_values * static_cast<double>(z);
  switch (output.format.kind) {
    case FormatKind::vdb:
    case FormatKind::nanovdb:
      // NanoVDB's grids are made of OpenVDB's.
      check_memory(path.string(),
                   vdb_bytes(output, volume) * (output.format.kind == FormatKind::vdb ? 1 : 2),
                   streams);
      check_disk(path, values * min_vdb_bytes, smaller(output), Need::at_least);
      check_file_size(path, values * min_vdb_bytes, splits, Need::at_least);
      warn_of_disk(path, vdb_bytes(output, volume), stops);
      return;
    case FormatKind::png:
    case FormatKind::exr: {
      const double bytes = output.format.kind == FormatKind::png ? min_png_bytes : min_exr_bytes;
      // A slice as the model has it, as an image, and encoded.
      check_memory(path.string(), 3 * slice_values * sizeof(float),
                   ".zarr and .npy are written piece by piece");
      check_disk(path, values * bytes, "", Need::at_least);
      check_file_size(path, slice_values * bytes, "", Need::at_least);
      warn_of_disk(path, values * static_cast<double>(output.bytes_per_value()), stops);
      return;
    }
    case FormatKind::dds:
    case FormatKind::ktx2: {
      // All levels encoded; the largest as floats and, for blocks, in bytes.
      const double bytes = texture_bytes(output, volume.size);
      const double texel = padded_channels(output) * static_cast<double>(sizeof(float) + 1);
      const auto texels = static_cast<double>(voxel_count(volume.size));
      check_memory(path.string(), texels * texel + bytes, streams);
      check_disk(path, bytes, smaller(output));
      check_file_size(path, bytes, splits);
      return;
    }
    case FormatKind::flipbook: {
      const FlipbookSheet sheet = flipbook_sheet(volume.size);
      constexpr std::int64_t max_edge = 16384;
      if (std::max(sheet.width, sheet.height) > max_edge) {
        throw std::runtime_error(fmt::format(
            "{}: needs a sheet of {} x {} pixels, graphics cards hold {}; .dds, .ktx2 and .zarr "
            "hold more",
            path.string(), sheet.width, sheet.height, max_edge));
      }
      // The sheet and its file.
      const double bytes = static_cast<double>(sheet.width * sheet.height) *
                           static_cast<double>(output.bytes_per_voxel());
      check_memory(path.string(), 2 * bytes, streams);
      check_disk(path, values * min_png_bytes, "", Need::at_least);
      check_file_size(path, values * min_png_bytes, splits, Need::at_least);
      warn_of_disk(path, bytes, stops);
      return;
    }
    default: {
      const double bytes = values * static_cast<double>(output.bytes_per_value()) +
                           (output.format.kind == FormatKind::npy ? npy_header_bytes : 0);
      // A piece as the model has it, and encoded.
      check_memory(path.string(), 2 * piece_bytes(volume, block), "a smaller --block needs less");
      check_disk(path, bytes, smaller(output));
      check_file_size(path, bytes, splits);
    }
  }
}

std::unique_ptr<Sink> make_sink(const fs::path& path, const Output& output, const Volume& volume) {
  switch (output.format.kind) {
    case FormatKind::npy:
      return make_npy_sink(path, output, volume);
    case FormatKind::png:
    case FormatKind::exr:
      return make_slice_sink(path, output, volume);
    case FormatKind::dds:
    case FormatKind::ktx2:
      return make_texture_sink(path, output, volume);
    case FormatKind::flipbook:
      return make_flipbook_sink(path, output, volume);
    case FormatKind::vdb:
    case FormatKind::nanovdb:
#ifdef SOLIDTEX_HAS_OPENVDB
      return make_vdb_sink(path, output, volume);
#endif
      break;
    default:
      return make_raw_sink(path, output, volume);
  }
  throw std::logic_error("make_sink: this kind of output is not built in");
}

}  // namespace solidtex::tools
