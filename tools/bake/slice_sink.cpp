#include <algorithm>
#include <cstdio>

#include "tools/bake/channel_groups.h"
#include "tools/bake/image.h"
#include "tools/bake/sink.h"
#include "tools/common/cli.h"

namespace solidtex::tools {
namespace {

float png_value(float value, Encoding encoding) {
  return encoding == Encoding::linear ? linear_to_srgb(value) : value;
}

float exr_value(float value, Encoding encoding) {
  return encoding == Encoding::srgb ? srgb_to_linear(value) : value;
}

std::vector<std::string> exr_names(const Volume& volume, const std::vector<ChannelGroup>& groups) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < volume.channels(); ++i) {
    names.push_back(volume.texture.channel_name(i));
  }
  for (const ChannelGroup& group : groups) {
    if (group.name != "albedo") continue;  // the image's colour, by the names viewers look for
    for (std::size_t i = 0; i < 3; ++i) names[group.first + i] = std::string(1, "RGB"[i]);
  }
  return names;
}

class SliceSink : public Sink {
 public:
  SliceSink(std::filesystem::path folder, const Volume& volume, std::string format)
      : folder_(std::move(folder)),
        format_(std::move(format)),
        channels_(volume.channels()),
        digits_(std::max<int>(4, static_cast<int>(std::to_string(volume.size[2] - 1).size()))),
        groups_(channel_groups(volume.texture)),
        exr_names_(exr_names(volume, groups_)) {
    std::filesystem::create_directory(folder_);
  }

  void take(const Slab& slab) override {
    for (std::int64_t z = 0; z < slab.size[2]; ++z) {
      throw_if_interrupted();
      if (format_ == "exr") {
        write_exr(path("", slab.offset[2] + z), exr_image(slab, z), exr_names_);
        continue;
      }
      for (const ChannelGroup& group : groups_) {
        const std::string prefix = groups_.size() > 1 ? group.name + "-" : "";
        write_png(path(prefix, slab.offset[2] + z), png_image(slab, z, group));
      }
    }
  }

  void finish() override {}

 private:
  std::filesystem::path path(const std::string& prefix, std::int64_t z) const {
    char number[32];
    std::snprintf(number, sizeof number, "%0*lld", digits_, static_cast<long long>(z));
    return folder_ / (prefix + number + "." + format_);
  }

  // An image of `count` channels, each taken from the slab by value_of(voxel, channel).
  template <class ValueOf>
  Image image_of(const Slab& slab, std::int64_t z, std::size_t count,
                 const ValueOf& value_of) const {
    Image image(static_cast<int>(slab.size[0]), static_cast<int>(slab.size[1]),
                static_cast<int>(count));
    for (std::int64_t x = 0; x < slab.size[0]; ++x) {
      for (std::int64_t y = 0; y < slab.size[1]; ++y) {
        const std::int64_t voxel = (x * slab.size[1] + y) * slab.size[2] + z;
        const float* values = &slab.values[static_cast<std::size_t>(voxel) * channels_];
        float* pixel = image.pixel(static_cast<int>(x), static_cast<int>(y));
        for (std::size_t i = 0; i < count; ++i) pixel[i] = value_of(values, i);
      }
    }
    return image;
  }

  Image png_image(const Slab& slab, std::int64_t z, const ChannelGroup& group) const {
    return image_of(slab, z, group.count, [&](const float* voxel, std::size_t i) {
      return png_value(voxel[group.first + i], group.encoding);
    });
  }

  Image exr_image(const Slab& slab, std::int64_t z) const {
    std::vector<Encoding> encodings;
    for (const ChannelGroup& group : groups_) {
      encodings.insert(encodings.end(), group.count, group.encoding);
    }
    return image_of(slab, z, channels_, [&](const float* voxel, std::size_t i) {
      return exr_value(voxel[i], encodings[i]);
    });
  }

  std::filesystem::path folder_;
  std::string format_;
  std::size_t channels_;
  int digits_;
  std::vector<ChannelGroup> groups_;
  std::vector<std::string> exr_names_;
};

}  // namespace

std::unique_ptr<Sink> make_slice_sink(const std::filesystem::path& folder, const Volume& volume,
                                      const std::string& format) {
  return std::make_unique<SliceSink>(folder, volume, format);
}

}  // namespace solidtex::tools
