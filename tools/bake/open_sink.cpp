#include <stdexcept>

#include "tools/bake/sink.h"

namespace solidtex::tools {

OutputKind output_kind(const std::filesystem::path& output, const std::string& slices) {
  const std::string extension = output.extension().string();
  const bool file = extension == ".npy" || extension == ".vdb";
  if (!slices.empty() && file) {
    throw std::runtime_error("-o " + output.string() + ": --slices writes a folder, not a " +
                             extension + " file");
  }
  if (slices == "png") return OutputKind::png_slices;
  if (slices == "exr") return OutputKind::exr_slices;
  if (extension == ".npy") return OutputKind::npy;
  if (extension == ".vdb") return OutputKind::vdb;
  throw std::runtime_error("-o " + output.string() +
                           ": expected a name that ends in .npy or .vdb, or --slices png|exr for a "
                           "folder of images");
}

std::unique_ptr<Sink> make_sink(OutputKind kind, const std::filesystem::path& path,
                                const Volume& volume) {
  switch (kind) {
    case OutputKind::npy:
      return make_npy_sink(path, volume);
    case OutputKind::vdb:
      return make_vdb_sink(path, volume);
    case OutputKind::png_slices:
      return make_slice_sink(path, volume, "png");
    case OutputKind::exr_slices:
      return make_slice_sink(path, volume, "exr");
  }
  throw std::logic_error("unknown kind of output");
}

}  // namespace solidtex::tools
