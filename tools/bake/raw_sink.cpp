#include <tbb/parallel_for.h>

#include <optional>

#include "tools/bake/raw_layout.h"
#include "tools/bake/sink.h"
#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

namespace fs = std::filesystem;

RawLayout layout_of(const Output& output, const Volume& volume) {
  switch (output.format.kind) {
    case FormatKind::nrrd:
    case FormatKind::nhdr:
      return nrrd_layout(output, volume);
    case FormatKind::vti:
      return vti_layout(output, volume);
    case FormatKind::mitsuba:
      return mitsuba_layout(output, volume);
    case FormatKind::tiff:
    case FormatKind::imagej:
      return tiff_layout(output, volume);
    default:
      return plain_layout(output, volume);
  }
}

// Writes each row of voxels along x to its place.
class RawSink : public Sink {
 public:
  RawSink(const fs::path& path, const Output& output, const Volume& volume)
      : volume_(volume), layout_(layout_of(output, volume)), header_path_(path) {
    if (!layout_.header.empty()) voxels_.emplace(fs::path(output.path).replace_extension(".raw"));
    if (voxels_)
      file_.emplace(voxels_->temporary_path(), voxels_->target());
    else
      file_.emplace(path);
    for (const RawBlock& block : layout_.blocks) encoders_.emplace_back(output, block.channels);
    for (const RawText& text : layout_.texts)
      file_->write(text.offset, text.bytes.data(), text.bytes.size());
  }

  std::int64_t depth() const override { return volume_.size[2]; }

  void take(const Piece& piece) override {
    for (std::size_t i = 0; i < layout_.blocks.size(); ++i)
      tbb::parallel_for(std::int64_t{0}, piece.size[2],
                        [&](std::int64_t z) { write_slice(piece, z, i); });
  }

  void finish() override {
    file_->close();
    if (!voxels_) return;
    OutputFile header(header_path_);
    header.write(0, layout_.header.data(), layout_.header.size());
    header.close();
    voxels_->commit();
  }

 private:
  // Rows as long as the volume are contiguous in the file.
  void write_slice(const Piece& piece, std::int64_t z, std::size_t index) {
    const RawBlock& block = layout_.blocks[index];
    const VoxelEncoder& encoder = encoders_[index];
    const auto [size_x, size_y, size_z] = piece.size;
    const std::size_t row_bytes = static_cast<std::size_t>(size_x) * encoder.bytes_per_voxel();
    const std::int64_t rows = size_x == volume_.size[0] ? size_y : 1;
    std::vector<std::byte> bytes(static_cast<std::size_t>(rows) * row_bytes);
    // Neighbors along x are a plane of the piece apart.
    const std::size_t step = static_cast<std::size_t>(size_y * size_z) * volume_.channels();
    for (std::int64_t first = 0; first < size_y; first += rows) {
      for (std::int64_t row = 0; row < rows; ++row) {
        const auto voxel = static_cast<std::size_t>((first + row) * size_z + z);
        encoder.encode(&piece.values[voxel * volume_.channels()], step,
                       static_cast<std::size_t>(size_x),
                       &bytes[static_cast<std::size_t>(row) * row_bytes]);
      }
      const std::int64_t voxel = (piece.offset[1] + first) * volume_.size[0] + piece.offset[0];
      file_->write(block.offset +
                       static_cast<std::uint64_t>(piece.offset[2] + z) * block.slice_step +
                       static_cast<std::uint64_t>(voxel) * encoder.bytes_per_voxel(),
                   bytes.data(), bytes.size());
    }
  }

  Volume volume_;
  RawLayout layout_;
  std::vector<VoxelEncoder> encoders_;  // one for each block
  fs::path header_path_;
  std::optional<AtomicFile> voxels_;  // beside the header
  std::optional<OutputFile> file_;
};

}  // namespace

std::unique_ptr<Sink> make_raw_sink(const fs::path& path, const Output& output,
                                    const Volume& volume) {
  return std::make_unique<RawSink>(path, output, volume);
}

}  // namespace solidtex::tools
