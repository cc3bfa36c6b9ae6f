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

constexpr char streams[] =
    ".npy, .nrrd, .vti, .vol, .tif and .raw are written piece by piece, --slices png|exr slice by "
    "slice";
constexpr char smaller[] = "--slices png takes a quarter of a .npy, --depth 8 too";
constexpr char splits[] = "--slices png|exr writes smaller files";

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

}  // namespace

void check_room(const Output& output, const Volume& volume) {
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
      check_disk(path, values * min_vdb_bytes, smaller);
      check_file_size(path, values * min_vdb_bytes, splits);
      return;
    case FormatKind::png:
    case FormatKind::exr: {
      const double bytes = output.format.kind == FormatKind::png ? min_png_bytes : min_exr_bytes;
      // A slice as the model has it, as an image, and encoded.
      check_memory(path.string(), 3 * slice_values * sizeof(float),
                   ".npy is written piece by piece");
      check_disk(path, values * bytes, "");
      check_file_size(path, slice_values * bytes, "");
      return;
    }
    case FormatKind::dds:
    case FormatKind::ktx2: {
      // All levels together; the largest as floats and encoded, and its blocks.
      const auto padded =
          static_cast<double>(output.channels.size() == 3 ? 4 : output.channels.size());
      const double texels = values / static_cast<double>(output.channels.size()) * 8 / 7;
      const double bytes =
          texels * (output.is_bc7 ? 1 : padded * static_cast<double>(output.bytes_per_value()));
      check_memory(
          path.string(),
          texels * padded * static_cast<double>(sizeof(float) + output.bytes_per_value()) + bytes,
          streams);
      check_disk(path, bytes, smaller);
      check_file_size(path, bytes, splits);
      return;
    }
    case FormatKind::flipbook: {
      const FlipbookSheet sheet = flipbook_sheet(volume.size);
      constexpr std::int64_t max_edge = 16384;
      if (std::max(sheet.width, sheet.height) > max_edge) {
        throw std::runtime_error(fmt::format(
            "{}: needs a sheet of {} x {} pixels, graphics cards hold {}; give a smaller --size",
            path.string(), sheet.width, sheet.height, max_edge));
      }
      // The sheet and its file.
      const double bytes = static_cast<double>(sheet.width * sheet.height) *
                           static_cast<double>(output.bytes_per_voxel());
      check_memory(path.string(), 2 * bytes, streams);
      check_disk(path, values * min_png_bytes, "");
      check_file_size(path, values * min_png_bytes, splits);
      return;
    }
    default: {
      const double bytes = values * static_cast<double>(output.bytes_per_value());
      check_disk(path, bytes, smaller);
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
