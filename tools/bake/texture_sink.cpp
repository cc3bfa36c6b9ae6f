#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include "tools/bake/bc7.h"
#include "tools/bake/sink.h"
#include "tools/bake/texture_file.h"

namespace solidtex::tools {
namespace {

// Texels of a level: colors as linear light, three channels with an alpha of 1.
struct Level {
  Index3 size;
  std::vector<float> values;  // [z][y][x][channel]
};

// The part of an axis that a texel of the next level covers: whole texels and parts of them, since
// sizes are rounded down.
struct Coverage {
  std::int64_t first;
  std::vector<float> weights;
};

Coverage coverage(std::int64_t texel, std::int64_t fine, std::int64_t coarse) {
  const double scale = static_cast<double>(fine) / static_cast<double>(coarse);
  const double begin = static_cast<double>(texel) * scale, end = begin + scale;
  Coverage result{static_cast<std::int64_t>(begin), {}};
  for (std::int64_t i = result.first; i < fine && static_cast<double>(i) < end - 1e-9; ++i) {
    const double low = std::max(begin, static_cast<double>(i));
    const double high = std::min(end, static_cast<double>(i + 1));
    result.weights.push_back(static_cast<float>((high - low) / scale));
  }
  return result;
}

// Half the size along each axis, rounded down. Texels are means.
Level next_level(const Level& fine, std::size_t channels) {
  Level coarse;
  for (std::size_t axis = 0; axis < 3; ++axis)
    coarse.size[axis] = std::max(fine.size[axis] / 2, std::int64_t{1});
  coarse.values.resize(voxel_count(coarse.size) * channels);
  std::array<std::vector<Coverage>, 3> covered;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::int64_t i = 0; i < coarse.size[axis]; ++i)
      covered[axis].push_back(coverage(i, fine.size[axis], coarse.size[axis]));
  const auto add = [&](const std::array<const Coverage*, 3>& part, float* to) {
    for (std::size_t z = 0; z < part[2]->weights.size(); ++z) {
      for (std::size_t y = 0; y < part[1]->weights.size(); ++y) {
        for (std::size_t x = 0; x < part[0]->weights.size(); ++x) {
          const float weight = part[0]->weights[x] * part[1]->weights[y] * part[2]->weights[z];
          const std::int64_t row = (part[2]->first + static_cast<std::int64_t>(z)) * fine.size[1] +
                                   part[1]->first + static_cast<std::int64_t>(y);
          const std::int64_t texel =
              row * fine.size[0] + part[0]->first + static_cast<std::int64_t>(x);
          const float* from = &fine.values[static_cast<std::size_t>(texel) * channels];
          for (std::size_t i = 0; i < channels; ++i) to[i] += weight * from[i];
        }
      }
    }
  };
  tbb::parallel_for(std::size_t{0}, covered[2].size(), [&](std::size_t z) {
    float* to = &coarse.values[z * covered[1].size() * covered[0].size() * channels];
    for (const Coverage& y : covered[1])
      for (const Coverage& x : covered[0]) {
        add({&x, &y, &covered[2][z]}, to);
        to += channels;
      }
  });
  return coarse;
}

// The output as it is with channels 0, 1, 2 ... of linear light, and alpha.
Output stored_output(const Output& output) {
  Output stored = output;
  stored.channels.clear();
  for (ChannelGroup& group : stored.groups) {
    const Encoding encoding = output.encoding(group);
    if (encoding != Encoding::data) {
      group.encoding = Encoding::linear;
      stored.color_space = encoding == Encoding::srgb ? ColorSpace::srgb : ColorSpace::linear;
    }
    for (std::size_t& channel : group.channels) {
      channel = stored.channels.size();
      stored.channels.push_back(channel);
    }
  }
  if (stored.channels.size() == 3) {
    stored.groups.push_back({"alpha", {3}, Encoding::data});
    stored.channels.push_back(3);
  }
  return stored;
}

class TextureSink : public Sink {
 public:
  TextureSink(std::filesystem::path path, const Output& output, const Volume& volume)
      : path_(std::move(path)),
        volume_(volume),
        shown_(output),
        stored_(stored_output(output)),
        linear_(output),
        channels_(stored_.channels.size()) {
    linear_.color_space = ColorSpace::linear;
    level_.size = volume.size;
    level_.values.assign(voxel_count(volume.size) * channels_, 1.0f);
  }

  std::int64_t depth() const override { return volume_.size[2]; }

  void take(const Piece& piece) override {
    const VoxelEncoder encoder(linear_, linear_.channels, Depth::float32);
    tbb::parallel_for(std::int64_t{0}, piece.size[2], [&](std::int64_t z) {
      for (std::int64_t x = 0; x < piece.size[0]; ++x) {
        for (std::int64_t y = 0; y < piece.size[1]; ++y) {
          const std::int64_t from = (x * piece.size[1] + y) * piece.size[2] + z;
          const std::int64_t row = (piece.offset[2] + z) * volume_.size[1] + piece.offset[1] + y;
          const std::int64_t to = row * volume_.size[0] + piece.offset[0] + x;
          encoder.encode(&piece.values[static_cast<std::size_t>(from) * volume_.channels()], 0, 1,
                         reinterpret_cast<std::byte*>(
                             &level_.values[static_cast<std::size_t>(to) * channels_]));
        }
      }
    });
  }

  void finish() override {
    std::vector<TextureLevel> levels;
    while (true) {
      levels.push_back({level_.size, encode()});
      if (voxel_count(level_.size) == 1) break;
      level_ = next_level(level_, channels_);
    }
    const bool is_srgb = stored_.depth == Depth::uint8 && stored_.color_space == ColorSpace::srgb &&
                         stored_.groups.front().encoding == Encoding::linear && channels_ == 4;
    const TextureDescription description{channels_,
                                         stored_.depth,
                                         is_srgb,
                                         stored_.is_bc7,
                                         "solidtex " + std::string(solidtex::version()),
                                         placed_fields(shown_, volume_)};
    const auto write = stored_.format.kind == FormatKind::dds ? write_dds : write_ktx2;
    write(path_, description, levels);
  }

 private:
  std::vector<std::byte> encode() const {
    const VoxelEncoder encoder(stored_, stored_.channels);
    const std::size_t count = voxel_count(level_.size);
    std::vector<std::byte> bytes(count * encoder.bytes_per_voxel());
    encoder.encode(level_.values.data(), channels_, count, bytes.data());
    if (!stored_.is_bc7) return bytes;
    const auto [x, y, z] = level_.size;
    return compress_bc7({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, x, y,
                        z);
  }

  std::filesystem::path path_;
  Volume volume_;
  Output shown_;   // as it is asked for
  Output stored_;  // of the values in memory, for the file
  Output linear_;  // of the model's values, for memory
  std::size_t channels_;
  Level level_;
};

}  // namespace

std::unique_ptr<Sink> make_texture_sink(const std::filesystem::path& path, const Output& output,
                                        const Volume& volume) {
  return std::make_unique<TextureSink>(path, output, volume);
}

}  // namespace solidtex::tools
