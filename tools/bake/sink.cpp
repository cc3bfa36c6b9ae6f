#include "tools/bake/sink.h"

#include <algorithm>
#include <stdexcept>

#include "tools/bake/channels.h"
#include "tools/common/limits.h"
#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

namespace fs = std::filesystem;

#ifdef SOLIDTEX_HAS_OPENVDB
constexpr bool has_openvdb = true;
#else
constexpr bool has_openvdb = false;
#endif

// Bytes of a value in a compressed file, less than any shipped model takes. A file that turns out
// larger ends with the error of a full disk.
constexpr double min_png_bytes = 0.25, min_exr_bytes = 3, min_vdb_bytes = 2;

constexpr char streams[] = ".npy is written piece by piece, --slices png|exr slice by slice";
constexpr char smaller[] = "--slices png takes a quarter of a .npy";
constexpr char splits[] = "--slices png|exr writes smaller files";

double value_count(const Volume& volume, double x, double y, double z) {
  return x * y * z * static_cast<double>(volume.channels());
}

// OpenVDB holds leaves of 8^3 voxels, each with a mask and a place in the tree.
double vdb_bytes(const Volume& volume) {
  constexpr std::int64_t edge = 8;
  constexpr double voxels = edge * edge * edge, overhead = 128;
  double leaves = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t first = volume.origin[axis] >> 3;
    const std::int64_t last = (volume.origin[axis] + volume.size[axis] - 1) >> 3;
    leaves *= static_cast<double>(last - first + 1);
  }
  const auto grids = static_cast<double>(channel_groups(volume.texture).size());
  return leaves * (value_count(volume, voxels, 1, 1) * sizeof(float) + grids * overhead);
}

}  // namespace

OutputKind output_kind(const fs::path& output, const std::string& slices) {
  const std::string extension = lower_extension(output);
  const bool is_file = extension == ".npy" || extension == ".vdb";
  if (!slices.empty() && is_file) {
    throw std::runtime_error("-o " + output.string() + ": --slices writes a folder, not a " +
                             extension + " file");
  }
  if (slices == "png") return OutputKind::png_slices;
  if (slices == "exr") return OutputKind::exr_slices;
  if (extension == ".npy") return OutputKind::npy;
  if (extension != ".vdb") {
    throw std::runtime_error("-o " + output.string() +
                             ": expected a name that ends in .npy or .vdb, or --slices png|exr "
                             "for a folder of images");
  }
  if (!has_openvdb) {
    throw std::runtime_error("-o " + output.string() +
                             ": this solidtex-bake was built without OpenVDB and cannot write .vdb "
                             "(install libopenvdb-dev, configure with SOLIDTEX_WITH_OPENVDB=ON)");
  }
  return OutputKind::vdb;
}

void check_room(OutputKind kind, const fs::path& output, const Volume& volume) {
  const auto [x, y, z] = volume.size;
  const double slice = value_count(volume, static_cast<double>(x), static_cast<double>(y), 1);
  const double values = slice * static_cast<double>(z);
  switch (kind) {
    case OutputKind::npy:
      check_disk(output, values * sizeof(float), smaller);
      check_file_size(output, values * sizeof(float), splits);
      return;
    case OutputKind::vdb:
      check_memory(output.string(), vdb_bytes(volume), streams);
      check_disk(output, values * min_vdb_bytes, smaller);
      check_file_size(output, values * min_vdb_bytes, splits);
      return;
    case OutputKind::png_slices:
    case OutputKind::exr_slices: {
      const double bytes = kind == OutputKind::png_slices ? min_png_bytes : min_exr_bytes;
      // A slice as the model has it, as an image, and encoded.
      check_memory(output.string(), 3 * slice * sizeof(float), ".npy is written piece by piece");
      check_disk(output, values * bytes, "");
      check_file_size(output, slice * bytes, "");
      return;
    }
  }
}

std::unique_ptr<Sink> make_sink(OutputKind kind, const fs::path& path, const Volume& volume) {
  switch (kind) {
    case OutputKind::npy:
      return make_npy_sink(path, volume);
    case OutputKind::png_slices:
      return make_slice_sink(path, volume, "png");
    case OutputKind::exr_slices:
      return make_slice_sink(path, volume, "exr");
    case OutputKind::vdb:
#ifdef SOLIDTEX_HAS_OPENVDB
      return make_vdb_sink(path, volume);
#endif
      break;
  }
  throw std::logic_error("make_sink: this kind of output is not built in");
}

}  // namespace solidtex::tools
