// Where baked voxels go. One kind a file; made by open_sink from the name of the output.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "tools/bake/pieces.h"
#include "tools/bake/volume.h"

namespace solidtex::tools {

class Sink {
 public:
  virtual ~Sink() = default;
  // How many voxels along z the pieces may have; all with the same z come one after another.
  virtual std::int64_t depth() const = 0;
  virtual void take(const Piece& piece) = 0;
  virtual void finish() = 0;
};

// NumPy array, float32, [x][y][z][channel], values as the file has them.
std::unique_ptr<Sink> make_npy_sink(const std::filesystem::path& path, const Volume& volume);

// OpenVDB: a Vec3s grid for each colour, a float grid for each other channel. All in memory.
std::unique_ptr<Sink> make_vdb_sink(const std::filesystem::path& path, const Volume& volume);

// A folder of images, one for each z: x to the right, y down.
std::unique_ptr<Sink> make_slice_sink(const std::filesystem::path& folder, const Volume& volume,
                                      const std::string& format);

enum class OutputKind { npy, vdb, png_slices, exr_slices };

// From the name of the output and --slices; throws when they say nothing, or contradict each other.
OutputKind output_kind(const std::filesystem::path& output, const std::string& slices);

std::unique_ptr<Sink> make_sink(OutputKind kind, const std::filesystem::path& path,
                                const Volume& volume);

}  // namespace solidtex::tools
