// Writers of baked voxels, selected by the output's name and --slices.
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
  // Largest number of voxels along z in a piece. Pieces with the same z come one after another.
  virtual std::int64_t depth() const = 0;
  virtual void take(const Piece& piece) = 0;
  virtual void finish() = 0;
};

// NumPy array, float32, [x][y][z][channel], with the model's own values.
std::unique_ptr<Sink> make_npy_sink(const std::filesystem::path& path, const Volume& volume);

// OpenVDB file with a Vec3s grid per color and a float grid per other channel. The whole volume is
// in memory.
std::unique_ptr<Sink> make_vdb_sink(const std::filesystem::path& path, const Volume& volume);

// Folder of images, one for each z: x to the right, y down. `format` is "png" or "exr".
std::unique_ptr<Sink> make_slice_sink(const std::filesystem::path& folder, const Volume& volume,
                                      const std::string& format);

enum class OutputKind { npy, vdb, png_slices, exr_slices };

// Returns the kind of output for its name and --slices. Throws if they are missing, contradict each
// other, or name a format that this build cannot write.
OutputKind output_kind(const std::filesystem::path& output, const std::string& slices);

// Throws, with the bytes needed and available, if memory or the disk cannot hold the volume.
void check_room(OutputKind kind, const std::filesystem::path& output, const Volume& volume);

std::unique_ptr<Sink> make_sink(OutputKind kind, const std::filesystem::path& path,
                                const Volume& volume);

}  // namespace solidtex::tools
