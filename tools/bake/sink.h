// Writers of baked voxels.
#pragma once

#include <filesystem>
#include <memory>

#include "tools/bake/output.h"
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

// NumPy array, [x][y][z][channel].
std::unique_ptr<Sink> make_npy_sink(const std::filesystem::path& path, const Output& output,
                                    const Volume& volume);

// Uncompressed voxels and a header: .nrrd, .nhdr, .raw, .vti, .vol, .tif.
std::unique_ptr<Sink> make_raw_sink(const std::filesystem::path& path, const Output& output,
                                    const Volume& volume);

// OpenVDB file with a Vec3s grid per color and a float grid per other channel. The whole volume is
// in memory.
std::unique_ptr<Sink> make_vdb_sink(const std::filesystem::path& path, const Output& output,
                                    const Volume& volume);

// Folder of images, one for each z: x to the right, y down.
std::unique_ptr<Sink> make_slice_sink(const std::filesystem::path& folder, const Output& output,
                                      const Volume& volume);

// 3D texture with mip levels: .dds, .ktx2. The whole volume is in memory.
std::unique_ptr<Sink> make_texture_sink(const std::filesystem::path& path, const Output& output,
                                        const Volume& volume);

// One image with all slices beside each other, and a JSON file that describes it.
std::unique_ptr<Sink> make_flipbook_sink(const std::filesystem::path& path, const Output& output,
                                         const Volume& volume);

// A sheet that is about square, in pixels.
struct FlipbookSheet {
  std::int64_t columns, rows, width, height;
};
FlipbookSheet flipbook_sheet(const Index3& size);

// Throws, with the bytes needed and available, if memory or the disk cannot hold the volume.
// `block` is the edge of a piece; 0: choose_piece.
void check_room(const Output& output, const Volume& volume, std::int64_t block);

// A sink that writes to `path`, a temporary name of the output.
std::unique_ptr<Sink> make_sink(const std::filesystem::path& path, const Output& output,
                                const Volume& volume);

}  // namespace solidtex::tools
