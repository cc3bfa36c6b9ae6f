#include "tools/bake/zarr/shard_levels.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>

#include "plugins/common/vector_clones.h"
#include "tools/bake/zarr/light.h"

namespace solidtex::tools {
namespace {

// Layers of chunks along x that are evaluated at a time: the neighborhood of a piece costs less
// where it is thick. A layer of the next level covers two.
constexpr std::int64_t chunk_layers = 2;
constexpr std::int64_t max_step_bytes = 96 << 20;

// Adds `count` decoded values to the sums, as SrgbTables::decode has them. Returns false, and adds
// nothing, where one is beyond the table.
SOLIDTEX_VECTOR_CLONES bool add_decoded(const float* values, std::size_t count, const float* table,
                                        float* sums) {
  int beyond = 0;
  for (std::size_t i = 0; i < count; ++i) beyond |= !(values[i] >= 0 && values[i] < 1);
  if (beyond) return false;
  for (std::size_t i = 0; i < count; ++i) sums[i] += SrgbTables::between(table, values[i]);
  return true;
}

// Whether the channels are all of a voxel in its order, and colors to be decoded.
bool are_all_decoded(std::span<const StoredChannel> channels, std::size_t row_channels) {
  if (channels.size() != row_channels) return false;
  for (std::size_t i = 0; i < channels.size(); ++i)
    if (channels[i].source != i || channels[i].averaged != Curve::decode) return false;
  return true;
}

// Adds a row of voxels, as light, to the row of sums.
void add_row(const float* row, std::size_t row_channels, std::size_t voxels,
             std::span<const StoredChannel> channels, std::vector<float>& sums) {
  if (are_all_decoded(channels, row_channels) &&
      add_decoded(row, voxels * row_channels, srgb_tables.decoded(), sums.data()))
    return;
  for (std::size_t channel = 0; channel < channels.size(); ++channel) {
    const auto [source, stored, averaged] = channels[channel];
    const float* from = row + source;
    float* to = sums.data() + channel;
    for (std::size_t i = 0; i < voxels; ++i, from += row_channels, to += channels.size())
      *to += averaged == Curve::decode ? srgb_tables.decode(*from) : *from;
  }
}

// Averages neighbors along z. Where the number of voxels is odd, the last one stays alone.
void write_means(const std::vector<float>& sums, std::size_t voxels, std::size_t channels,
                 std::size_t rows, float* to) {
  for (std::size_t z = 0; z < voxels; z += 2) {
    const bool has_neighbor = z + 1 < voxels;
    const float scale = 1.0f / static_cast<float>(has_neighbor ? 2 * rows : rows);
    const float* sum = &sums[z * channels];
    for (std::size_t i = 0; i < channels; ++i)
      *to++ = (has_neighbor ? sum[i] + sum[i + channels] : sum[i]) * scale;
  }
}

Encoding stored_encoding(const Output& output, std::size_t channel) {
  for (const ChannelGroup& group : output.groups) {
    const bool is_in_group = std::ranges::find(group.channels, channel) != group.channels.end();
    if (is_in_group) return output.encoding(group);
  }
  return Encoding::data;
}

Index3 halves(const Index3& size) {
  return {(size[0] + 1) / 2, (size[1] + 1) / 2, (size[2] + 1) / 2};
}

}  // namespace

ShardLevels::ShardLevels(const std::filesystem::path& folder, const StoreLayout& layout,
                         const Index3& position, const Output& output, const Volume& volume,
                         BackgroundWriter& writer)
    : depth_(output.depth), model_channels_(volume.channels()), writer_(writer) {
  const std::vector<Encoding> encodings = channel_encodings(volume.texture);
  for (const std::size_t channel : output.channels) {
    const bool is_encoded = encodings[channel] == Encoding::srgb;
    const bool stays_encoded = stored_encoding(output, channel) == Encoding::srgb;
    const Curve stored = is_encoded == stays_encoded ? Curve::none
                         : is_encoded                ? Curve::decode
                                                     : Curve::encode;
    model_.push_back({channel, stored, is_encoded ? Curve::decode : Curve::none});
    light_.push_back({light_.size(), stays_encoded ? Curve::encode : Curve::none, Curve::none});
  }
  for (int i = 0; i < layout.level_count(); ++i) {
    const std::filesystem::path path = folder / layout.shard_path(i, position);
    make_folders(path.parent_path());
    Level level{std::make_shared<ShardFile>(path, layout, i),
                layout.shard_box(i, position).size,
                layout.chunk_edge(i),
                {},
                {},
                {}};
    if (i > 0) begin_layer(level, 0);
    levels_.push_back(std::move(level));
  }
}

void ShardLevels::begin_layer(Level& level, std::int64_t x) {
  level.layer_offset = {x, 0, 0};
  level.layer_size = {std::min(level.edge, level.size[0] - x), level.size[1], level.size[2]};
  level.missing = voxel_count(level.layer_size);
  level.layer.resize(level.missing * light_.size());
}

Index3 ShardLevels::piece_size() const {
  const Level& first = levels_.front();
  const std::int64_t planes = chunk_layers * first.edge;
  const std::int64_t row_bytes =
      planes * first.size[2] * static_cast<std::int64_t>(model_channels_ * sizeof(float));
  const std::int64_t rows = std::max(max_step_bytes / row_bytes / first.edge, std::int64_t{1});
  return {planes, std::min(rows * first.edge, first.size[1]), first.size[2]};
}

void ShardLevels::take(const Piece& piece) { process(0, piece); }

void ShardLevels::process(std::size_t level, const Piece& piece) {
  store(level, piece);
  if (level + 1 == levels_.size()) return;
  average(level, piece);
  Level& next = levels_[level + 1];
  next.missing -= voxel_count(halves(piece.size));
  if (next.missing > 0) return;
  process(level + 1, {next.layer_offset, next.layer_size, next.layer});
  const std::int64_t end = next.layer_offset[0] + next.layer_size[0];
  if (end < next.size[0]) begin_layer(next, end);
}

void ShardLevels::store(std::size_t index, const Piece& piece) {
  const Level& level = levels_[index];
  const std::span<const StoredChannel> channels = index == 0 ? model_ : light_;
  std::vector<Index3> offsets;  // in the order of the file
  for (std::int64_t x = 0; x < piece.size[0]; x += level.edge)
    for (std::int64_t z = 0; z < piece.size[2]; z += level.edge)
      for (std::int64_t y = 0; y < piece.size[1]; y += level.edge) offsets.push_back({x, y, z});
  std::vector<std::vector<ChunkBytes>> chunks(offsets.size());
  tbb::parallel_for(std::size_t{0}, offsets.size(), [&](std::size_t i) {
    chunks[i] = encode_chunk(piece, offsets[i], level.edge, channels, depth_);
  });
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    Index3 place{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      place[axis] = (piece.offset[axis] + offsets[i][axis]) / level.edge;
    for (std::size_t channel = 0; channel < channels.size(); ++channel) {
      const std::size_t size = chunks[i][channel].size();
      writer_.push(size,
                   [file = level.file, channel, place, bytes = std::move(chunks[i][channel])] {
                     file->append(channel, place, bytes);
                   });
    }
  }
}

void ShardLevels::average(std::size_t index, const Piece& piece) {
  Level& next = levels_[index + 1];
  const std::span<const StoredChannel> read = index == 0 ? model_ : light_;
  const std::size_t channels = read.size();
  const std::size_t piece_channels = index == 0 ? model_channels_ : channels;
  const Index3 size = halves(piece.size);
  const auto depth = static_cast<std::size_t>(piece.size[2]);
  tbb::parallel_for(std::int64_t{0}, size[0], [&](std::int64_t x) {
    std::vector<float> sums;
    for (std::int64_t y = 0; y < size[1]; ++y) {
      sums.assign(depth * channels, 0);
      std::size_t rows = 0;
      for (std::int64_t i = 2 * x; i < std::min(2 * x + 2, piece.size[0]); ++i) {
        for (std::int64_t j = 2 * y; j < std::min(2 * y + 2, piece.size[1]); ++j, ++rows)
          add_row(&piece.values[voxel_index(piece.size, {i, j, 0}) * piece_channels],
                  piece_channels, depth, read, sums);
      }
      const std::size_t to =
          voxel_index(next.layer_size, {piece.offset[0] / 2 + x - next.layer_offset[0],
                                        piece.offset[1] / 2 + y, piece.offset[2] / 2});
      write_means(sums, depth, channels, rows, &next.layer[to * channels]);
    }
  });
}

void ShardLevels::finish() {
  for (const Level& level : levels_) writer_.push(0, [file = level.file] { file->finish(); });
  levels_.clear();
}

double ShardLevels::memory(const StoreLayout& layout, const Volume& volume) {
  const auto voxel = static_cast<double>(layout.channels) * sizeof(float);
  const auto row = static_cast<double>(chunk_layers * layout.chunk_edge(0) * layout.chunk_edge(0)) *
                   static_cast<double>(volume.channels()) * sizeof(float);
  // A piece, and its chunks.
  double bytes = 2 * std::max<double>(max_step_bytes, row * static_cast<double>(layout.shard_edge));
  for (int level = 1; level < layout.level_count(); ++level) {
    const auto edge = static_cast<double>(layout.shard_edge_of(level));
    bytes += static_cast<double>(layout.chunk_edge(level)) * edge * edge * voxel;
  }
  return bytes;
}

}  // namespace solidtex::tools
