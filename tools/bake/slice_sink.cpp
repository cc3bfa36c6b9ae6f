#include <algorithm>
#include <cstdio>

#include "tools/bake/channels.h"
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
  SliceSink(std::filesystem::path folder, const Volume& volume, std::string format)
      : folder_(std::move(folder)),
        format_(std::move(format)),
        size_(volume.size),
        channels_(volume.channels()),
        depth_(slab_depth(volume)),
        digits_(std::max<int>(4, static_cast<int>(std::to_string(volume.size[2] - 1).size()))),
        groups_(channel_groups(volume.texture)),
        encodings_(channel_encodings(volume.texture)),
        exr_names_(exr_names(volume.texture)) {
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
    for (std::int64_t z = 0; z < slab_.size[2]; ++z) {
      throw_if_interrupted();
      if (format_ == "exr") {
        write_exr(path("", slab_.offset[2] + z), z);
        continue;
      }
      for (const ChannelGroup& group : groups_) {
        const std::string prefix = groups_.size() > 1 ? group.name + "-" : "";
        write_png(path(prefix, slab_.offset[2] + z), png_image(z, group));
      }
    }
  }

  std::filesystem::path path(const std::string& prefix, std::int64_t z) const {
    char number[32];
    std::snprintf(number, sizeof number, "%0*lld", digits_, static_cast<long long>(z));
    return folder_ / (prefix + number + "." + format_);
  }

  // An image of `count` channels; value_of(voxel, channel) gives each value.
  template <class ValueOf>
  Image image_of(std::int64_t z, std::size_t count, const ValueOf& value_of) const {
    Image image(static_cast<int>(slab_.size[0]), static_cast<int>(slab_.size[1]),
                static_cast<int>(count));
    for (std::int64_t x = 0; x < slab_.size[0]; ++x) {
      for (std::int64_t y = 0; y < slab_.size[1]; ++y) {
        const std::int64_t voxel = (x * slab_.size[1] + y) * slab_.size[2] + z;
        const float* values = &slab_.values[static_cast<std::size_t>(voxel) * channels_];
        float* pixel = image.pixel(static_cast<int>(x), static_cast<int>(y));
        for (std::size_t i = 0; i < count; ++i) pixel[i] = value_of(values, i);
      }
    }
    return image;
  }

  Image png_image(std::int64_t z, const ChannelGroup& group) const {
    return image_of(z, group.channels.size(), [&](const float* voxel, std::size_t i) {
      return display_value(voxel[group.channels[i]], group.encoding);
    });
  }

  void write_exr(const std::filesystem::path& path, std::int64_t z) const {
    const Image image = image_of(z, channels_, [&](const float* voxel, std::size_t i) {
      return light_value(voxel[i], encodings_[i]);
    });
    ExrFile file(path, image.width, image.height, exr_names_);
    file.write_rows(image.values.data(), image.height);
    file.close();
  }

  std::filesystem::path folder_;
  std::string format_;
  Index3 size_;
  std::size_t channels_;
  std::int64_t depth_;
  int digits_;
  std::vector<ChannelGroup> groups_;
  std::vector<Encoding> encodings_;
  std::vector<std::string> exr_names_;
  Slab slab_;
  std::size_t missing_ = 0;  // voxels of the slab that have not come yet
};

}  // namespace

std::unique_ptr<Sink> make_slice_sink(const std::filesystem::path& folder, const Volume& volume,
                                      const std::string& format) {
  return std::make_unique<SliceSink>(folder, volume, format);
}

}  // namespace solidtex::tools
