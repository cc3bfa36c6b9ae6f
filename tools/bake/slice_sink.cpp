#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdio>

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
    std::filesystem::create_directory(folder_);
  }

  std::int64_t depth() const override { return depth_; }

  void take(const Piece& piece) override {
    if (missing_ == 0) begin_slab(piece);
    copy(piece);
    missing_ -= voxel_count(piece.size);
    if (missing_ == 0) write_slab();
  }

  void finish() override {}

 private:
  // Neighboring slices, written when their last piece has come.
  struct Slab {
    Index3 offset, size;
    std::vector<float> values;  // [x][y][z][channel]
  };

  void begin_slab(const Piece& piece) {
    slab_.offset = {0, 0, piece.offset[2]};
    slab_.size = {size_[0], size_[1], piece.size[2]};
    missing_ = voxel_count(slab_.size);
    slab_.values.resize(missing_ * channels_);
  }

  void copy(const Piece& piece) {
    const std::size_t row = static_cast<std::size_t>(piece.size[2]) * channels_;
    const float* from = piece.values.data();
    for (std::int64_t x = 0; x < piece.size[0]; ++x) {
      const std::int64_t first = (piece.offset[0] + x) * size_[1] + piece.offset[1];
      std::copy_n(from, static_cast<std::size_t>(piece.size[1]) * row,
                  &slab_.values[static_cast<std::size_t>(first) * row]);
      from += static_cast<std::size_t>(piece.size[1]) * row;
    }
  }

  void write_slab() const {
    tbb::parallel_for(std::int64_t{0}, slab_.size[2], [this](std::int64_t z) {
      throw_if_interrupted();
      for (std::size_t i = 0; i < encoders_.size(); ++i) {
        const bool has_prefix = !is_exr_ && output_.groups.size() > 1;
        const std::string prefix = has_prefix ? output_.groups[i].name + "-" : "";
        write_image(path(prefix, slab_.offset[2] + z), pixels(z, encoders_[i]), i);
      }
    });
  }

  std::filesystem::path path(const std::string& prefix, std::int64_t z) const {
    char number[32];
    std::snprintf(number, sizeof number, "%0*lld", digits_, static_cast<long long>(z));
    return folder_ / (prefix + number + (is_exr_ ? ".exr" : ".png"));
  }

  // The pixels of a slice, row by row.
  std::vector<std::byte> pixels(std::int64_t z, const VoxelEncoder& encoder) const {
    const auto [width, height, depth] = slab_.size;
    const std::size_t row = static_cast<std::size_t>(width) * encoder.bytes_per_voxel();
    std::vector<std::byte> bytes(static_cast<std::size_t>(height) * row);
    for (std::int64_t y = 0; y < height; ++y) {
      encoder.encode(&slab_.values[static_cast<std::size_t>(y * depth + z) * channels_],
                     static_cast<std::size_t>(height * depth) * channels_,
                     static_cast<std::size_t>(width), &bytes[static_cast<std::size_t>(y) * row]);
    }
    return bytes;
  }

  void write_image(const std::filesystem::path& path, const std::vector<std::byte>& pixels,
                   std::size_t index) const {
    const auto width = static_cast<int>(size_[0]), height = static_cast<int>(size_[1]);
    if (is_exr_) {
      ExrFile file(path, width, height, exr_names_, output_.depth == Depth::half);
      file.write_rows(pixels.data(), height);
      file.close();
    } else {
      const ChannelGroup& group = output_.groups[index];
      write_png(path,
                {width, height, static_cast<int>(group.channels.size()),
                 output_.depth == Depth::uint16, output_.encoding(group) == Encoding::linear},
                pixels);
    }
  }

  std::filesystem::path folder_;
  Output output_;
  bool is_exr_;
  Index3 size_;
  std::size_t channels_;
  std::int64_t depth_;
  int digits_;
  std::vector<VoxelEncoder> encoders_;  // one for each image of a slice
  std::vector<std::string> exr_names_;
  Slab slab_;
  std::size_t missing_ = 0;  // voxels of the slab that have not come yet
};

}  // namespace

std::unique_ptr<Sink> make_slice_sink(const std::filesystem::path& folder, const Output& output,
                                      const Volume& volume) {
  return std::make_unique<SliceSink>(folder, output, volume);
}

}  // namespace solidtex::tools
