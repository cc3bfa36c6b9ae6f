#include "tools/bake/zarr/chunk.h"

#include <Imath/half.h>
#include <blosc.h>
#include <isa-l/crc.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <stdexcept>

#include "tools/bake/zarr/light.h"

namespace solidtex::tools {
namespace {

static_assert(std::endian::native == std::endian::little, "the codec `bytes` of a store says so");

using Values = std::vector<float>;

// Memory that a thread keeps: fresh memory costs a page fault for each 4 KiB.
struct Scratch {
  std::vector<Values> chunks;  // a chunk of each channel, [z][y][x]
  Values plane;                // [channel][z][x]
  ChunkBytes compressed;
};

// Gathers the voxels of one y. In the piece neighbors along x are far apart, and in the chunk
// neighbors along z, so the plane is made in memory that stays in the cache. A row of the piece is
// asked for some rows ahead.
void gather(const Piece& piece, const Index3& offset, const Index3& end, std::int64_t edge,
            std::int64_t y, std::span<const StoredChannel> channels, Scratch& scratch) {
  constexpr std::int64_t rows_ahead = 4, floats_in_line = 16;
  const auto piece_channels =
      static_cast<std::int64_t>(piece.values.size() / voxel_count(piece.size));
  const std::int64_t row_pitch = piece.size[1] * piece.size[2] * piece_channels;
  const std::size_t first = voxel_index(piece.size, {offset[0], offset[1] + y, offset[2]});
  const float* row = piece.values.data() + first * static_cast<std::size_t>(piece_channels);
  const std::int64_t plane_size = edge * edge;
  scratch.plane.resize(channels.size() * static_cast<std::size_t>(plane_size));
  for (std::int64_t x = 0; x < end[0]; ++x, row += row_pitch) {
    if (x + rows_ahead < end[0])
      for (std::int64_t i = 0; i < end[2] * piece_channels; i += floats_in_line)
        __builtin_prefetch(row + rows_ahead * row_pitch + i);
    float* to = scratch.plane.data() + x;
    for (const StoredChannel& channel : channels) {
      const float* from = row + channel.source;
      for (std::int64_t z = 0; z < end[2]; ++z) to[z * edge] = from[z * piece_channels];
      to += plane_size;
    }
  }
  const float* from = scratch.plane.data();
  for (Values& chunk : scratch.chunks) {
    for (std::int64_t z = 0; z < end[2]; ++z)
      std::copy_n(from + z * edge, end[0], chunk.data() + z * plane_size + y * edge);
    from += plane_size;
  }
}

void apply(Curve curve, Values& values) {
  if (curve == Curve::encode)
    for (float& value : values) value = srgb_tables.encode(value);
  if (curve == Curve::decode)
    for (float& value : values) value = srgb_tables.decode(value);
}

// Returns the bytes of `size` bytes at `values` in a store.
ChunkBytes compress(const void* values, std::size_t size, std::size_t value_size,
                    ChunkBytes& buffer) {
  const std::size_t capacity = size + BLOSC_MAX_OVERHEAD;
  buffer.resize(capacity + sizeof(std::uint32_t));
  const int used = blosc_compress_ctx(blosc_level, BLOSC_BITSHUFFLE, value_size, size, values,
                                      buffer.data(), capacity, blosc_compressor,
                                      /*blocksize=*/0, /*threads=*/1);
  if (used <= 0) throw std::runtime_error("Blosc: cannot compress " + std::to_string(size));
  unsigned char* const end = buffer.data() + used;
  const std::uint32_t checksum = crc32c({buffer.data(), end});
  std::memcpy(end, &checksum, sizeof checksum);
  return {buffer.data(), end + sizeof checksum};
}

template <class Convert>
ChunkBytes compress_as(const Values& values, const Convert& convert, ChunkBytes& buffer) {
  using Value = decltype(convert(0.0f));
  std::vector<Value> converted(values.size());
  std::ranges::transform(values, converted.begin(), convert);
  return compress(converted.data(), converted.size() * sizeof(Value), sizeof(Value), buffer);
}

ChunkBytes compress_at(Depth depth, const Values& values, ChunkBytes& buffer) {
  switch (depth) {
    case Depth::uint8:
      return compress_as(values, quantize<std::uint8_t>, buffer);
    case Depth::uint16:
      return compress_as(values, quantize<std::uint16_t>, buffer);
    case Depth::half:
      return compress_as(
          values, [](float value) { return Imath::half(value).bits(); }, buffer);
    case Depth::float32:
      break;
  }
  return compress(values.data(), values.size() * sizeof(float), sizeof(float), buffer);
}

}  // namespace

std::uint32_t crc32c(std::span<const unsigned char> bytes) {
  return ~crc32_iscsi(const_cast<unsigned char*>(bytes.data()), static_cast<int>(bytes.size()),
                      ~std::uint32_t{0});
}

std::vector<ChunkBytes> encode_chunk(const Piece& piece, const Index3& offset, std::int64_t edge,
                                     std::span<const StoredChannel> channels, Depth depth) {
  static thread_local Scratch scratch;
  Index3 end{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    end[axis] = std::min(edge, piece.size[axis] - offset[axis]);
  const auto size = static_cast<std::size_t>(edge * edge * edge);
  const bool is_whole = voxel_count(end) == size;
  scratch.chunks.resize(channels.size());
  for (Values& chunk : scratch.chunks) {
    chunk.resize(size);
    if (!is_whole) std::ranges::fill(chunk, 0.0f);
  }
  for (std::int64_t y = 0; y < end[1]; ++y) gather(piece, offset, end, edge, y, channels, scratch);
  std::vector<ChunkBytes> chunks;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    apply(channels[i].stored, scratch.chunks[i]);
    chunks.push_back(compress_at(depth, scratch.chunks[i], scratch.compressed));
  }
  return chunks;
}

}  // namespace solidtex::tools
