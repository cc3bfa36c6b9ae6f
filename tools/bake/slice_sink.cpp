#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdio>

#include "tools/bake/description.h"
#include "tools/bake/image_file.h"
#include "tools/bake/sink.h"
#include "tools/common/cli.h"
#include "tools/common/limits.h"

namespace solidtex::tools {
namespace {

constexpr std::int64_t brick = 16;
constexpr std::uint64_t max_slab_bytes = 192 << 20;

// The number of slices to hold at a time: whole bricks where they fit.
std::int64_t slab_depth(const Volume& volume) {
  const auto slice_bytes = volume.size[0] * volume.size[1] *
                           static_cast<std::int64_t>(volume.channels() * sizeof(float));
  const auto slab_bytes =
      static_cast<std::int64_t>(std::min(max_slab_bytes, available_memory() / 4));
  const std::int64_t slices = std::max(slab_bytes / slice_bytes, std::int64_t{1});
  return slices < brick ? slices : slices / brick * brick;
}

class SliceSink : public Sink {
 public:
  SliceSink(std::filesystem::path folder, const Output& output, const Volume& volume)
      : folder_(std::move(folder)),
        output_(output),
        volume_(volume),
        is_exr_(output.format.kind == FormatKind::exr),
        size_(volume.size),
        channels_(volume.channels()),
        depth_(slab_depth(volume)),
        digits_(std::max<int>(4, static_cast<int>(std::to_string(volume.size[2] - 1).size()))) {
    const std::vector<std::string> names = exr_names(volume.texture);
    for (const std::size_t channel : output.channels) exr_names_.push_back(names[channel]);
    if (is_exr_) {
      encoders_.emplace_back(output, output.channels);
    } else {
      for (const ChannelGroup& group : output.groups)
        encoders_.emplace_back(output, group.channels);
    }
    images_.resize(encoders_.size());
    std::filesystem::create_directory(folder_);
  }

  std::int64_t depth() const override { return depth_; }

  void take(const Piece& piece) override {
    if (missing_ == 0) begin_slab(piece);
    tbb::parallel_for(std::int64_t{0}, piece.size[1], [&](std::int64_t y) {
      for (std::size_t i = 0; i < encoders_.size(); ++i) encode_rows(piece, y, i);
    });
    missing_ -= voxel_count(piece.size);
    if (missing_ == 0) write_slab();
  }

  void finish() override {}

 private:
  void begin_slab(const Piece& piece) {
    slab_z_ = piece.offset[2];
    slab_depth_ = piece.size[2];
    missing_ = voxel_count({size_[0], size_[1], slab_depth_});
    for (std::size_t i = 0; i < encoders_.size(); ++i)
      images_[i].resize(missing_ * encoders_[i].bytes_per_voxel());
  }

  // Encodes one row of each image. Voxels are neighbors along z in the piece, and along x in an
  // image.
  void encode_rows(const Piece& piece, std::int64_t y, std::size_t index) {
    const auto width = static_cast<std::size_t>(piece.size[0]);
    const auto depth = static_cast<std::size_t>(piece.size[2]);
    const VoxelEncoder& encoder = encoders_[index];
    const std::size_t pixel = encoder.bytes_per_voxel();
    std::vector<std::byte> encoded(width * depth * pixel);  // [x][z]
    for (std::size_t x = 0; x < width; ++x) {
      const Index3 first{static_cast<std::int64_t>(x), y, 0};
      encoder.encode(&piece.values[voxel_index(piece.size, first) * channels_], channels_, depth,
                     &encoded[x * depth * pixel]);
    }
    for (std::size_t z = 0; z < depth; ++z) {
      const Index3 first{static_cast<std::int64_t>(z), piece.offset[1] + y, piece.offset[0]};
      std::byte* to =
          &images_[index][voxel_index({slab_depth_, size_[1], size_[0]}, first) * pixel];
      for (std::size_t x = 0; x < width; ++x, to += pixel)
        std::copy_n(&encoded[(x * depth + z) * pixel], pixel, to);
    }
  }

  void write_slab() const {
    tbb::parallel_for(std::int64_t{0}, slab_depth_, [this](std::int64_t z) {
      throw_if_interrupted();
      for (std::size_t i = 0; i < encoders_.size(); ++i) {
        const bool has_prefix = !is_exr_ && output_.groups.size() > 1;
        const std::string prefix = has_prefix ? output_.groups[i].name + "-" : "";
        const std::span<const std::byte> images = images_[i];
        const std::size_t image = images.size() / static_cast<std::size_t>(slab_depth_);
        write_image(path(prefix, slab_z_ + z),
                    images.subspan(static_cast<std::size_t>(z) * image, image), i,
                    notes(slab_z_ + z));
      }
    });
  }

  std::filesystem::path path(const std::string& prefix, std::int64_t z) const {
    char number[32];
    std::snprintf(number, sizeof number, "%0*lld", digits_, static_cast<long long>(z));
    return folder_ / (prefix + number + (is_exr_ ? ".exr" : ".png"));
  }

  // Scale and place of one slice.
  ImageNotes notes(std::int64_t z) const {
    Volume slice = volume_;
    slice.origin[2] += z;
    const VoxelSize& voxel = output_.voxel_size;
    ImageNotes notes{placed_fields(output_, slice), voxel.edges[0], voxel.edges[1],
                     !voxel.unit.empty()};
    if (!notes.is_in_meters) return notes;
    constexpr double meter = 1e6;  // micrometers
    notes.width = voxel.micrometers(0) / meter;
    notes.height = voxel.micrometers(1) / meter;
    return notes;
  }

  // The encoding of R, G and B, or of the first color.
  Encoding colors() const {
    for (const ChannelGroup& group : output_.groups)
      if (output_.encoding(group) != Encoding::data) return output_.encoding(group);
    return Encoding::data;
  }

  void write_image(const std::filesystem::path& path, std::span<const std::byte> pixels,
                   std::size_t index, const ImageNotes& notes) const {
    const auto width = static_cast<int>(size_[0]), height = static_cast<int>(size_[1]);
    if (is_exr_) {
      ExrFile file(path, width, height, exr_names_, colors(), output_.depth == Depth::half, notes);
      file.write_rows(pixels.data(), height);
      file.close();
    } else {
      const ChannelGroup& group = output_.groups[index];
      write_png(path,
                {width, height, static_cast<int>(group.channels.size()),
                 output_.depth == Depth::uint16, output_.encoding(group), notes},
                pixels);
    }
  }

  std::filesystem::path folder_;
  Output output_;
  Volume volume_;
  bool is_exr_;
  Index3 size_;
  std::size_t channels_;
  std::int64_t depth_;
  int digits_;
  std::vector<VoxelEncoder> encoders_;  // one for each image of a slice
  std::vector<std::string> exr_names_;
  // Neighboring slices, written when their last piece has come.
  std::int64_t slab_z_ = 0, slab_depth_ = 0;
  std::vector<std::vector<std::byte>> images_;  // [encoder][z][y][x]
  std::size_t missing_ = 0;                     // voxels of the slab that have not come yet
};

}  // namespace

std::unique_ptr<Sink> make_slice_sink(const std::filesystem::path& folder, const Output& output,
                                      const Volume& volume) {
  return std::make_unique<SliceSink>(folder, output, volume);
}

}  // namespace solidtex::tools
