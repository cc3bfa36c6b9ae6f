#include "tools/bake/zarr/chunk.h"

#include <Imath/half.h>
#include <blosc.h>
#include <isa-l/crc.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <stdexcept>

#include "tools/bake/zarr/light.h"

namespace solidtex::tools {
namespace {

static_assert(std::endian::native == std::endian::little, "the codec `bytes` of a store says so");

using Values = std::vector<float>;  // [z][y][x]

// Goes through the voxels of one y in small squares of x and z: neither side's rows stay in the
// cache for long.
void gather(const Piece& piece, const Index3& offset, std::int64_t edge, std::size_t channel,
            std::int64_t y, Values& values) {
  constexpr std::int64_t square = 16;
  const auto [width, height, depth] = piece.size;
  const std::size_t channel_count = piece.values.size() / voxel_count(piece.size);
  const std::int64_t x_end = std::min(edge, width - offset[0]);
  const std::int64_t z_end = std::min(edge, depth - offset[2]);
  const auto row = [&](std::int64_t x) {
    const std::int64_t first = ((offset[0] + x) * height + offset[1] + y) * depth + offset[2];
    return piece.values.data() + static_cast<std::size_t>(first) * channel_count + channel;
  };
  for (std::int64_t x_begin = 0; x_begin < x_end; x_begin += square) {
    const std::int64_t x_stop = std::min(x_begin + square, x_end);
    for (std::int64_t z_begin = 0; z_begin < z_end; z_begin += square) {
      const std::int64_t z_stop = std::min(z_begin + square, z_end);
      for (std::int64_t x = x_begin; x < x_stop; ++x) {
        const float* from = row(x);
        float* to = &values[static_cast<std::size_t>(y * edge + x)];
        for (std::int64_t z = z_begin; z < z_stop; ++z)
          to[z * edge * edge] = from[static_cast<std::size_t>(z) * channel_count];
      }
    }
  }
}

void apply(Curve curve, Values& values) {
  if (curve == Curve::encode)
    for (float& value : values) value = srgb_tables.encode(value);
  if (curve == Curve::decode)
    for (float& value : values) value = srgb_tables.decode(value);
}

ChunkBytes compress(const void* values, std::size_t size, std::size_t value_size) {
  ChunkBytes bytes(size + BLOSC_MAX_OVERHEAD + sizeof(std::uint32_t));
  const int used = blosc_compress_ctx(blosc_level, BLOSC_BITSHUFFLE, value_size, size, values,
                                      bytes.data(), size + BLOSC_MAX_OVERHEAD, blosc_compressor,
                                      /*blocksize=*/0, /*threads=*/1);
  if (used <= 0) throw std::runtime_error("Blosc: cannot compress " + std::to_string(size));
  bytes.resize(static_cast<std::size_t>(used));
  const std::uint32_t checksum = crc32c(bytes);
  const auto* tail = reinterpret_cast<const unsigned char*>(&checksum);
  bytes.insert(bytes.end(), tail, tail + sizeof checksum);
  return bytes;
}

template <class Convert>
ChunkBytes compress_as(const Values& values, const Convert& convert) {
  using Value = decltype(convert(0.0f));
  std::vector<Value> converted(values.size());
  std::ranges::transform(values, converted.begin(), convert);
  return compress(converted.data(), converted.size() * sizeof(Value), sizeof(Value));
}

ChunkBytes compress_at(Depth depth, const Values& values) {
  switch (depth) {
    case Depth::uint8:
      return compress_as(values, quantize<std::uint8_t>);
    case Depth::uint16:
      return compress_as(values, quantize<std::uint16_t>);
    case Depth::half:
      return compress_as(values, [](float value) { return Imath::half(value).bits(); });
    case Depth::float32:
      break;
  }
  return compress(values.data(), values.size() * sizeof(float), sizeof(float));
}

}  // namespace

std::uint32_t crc32c(std::span<const unsigned char> bytes) {
  return ~crc32_iscsi(const_cast<unsigned char*>(bytes.data()), static_cast<int>(bytes.size()),
                      ~std::uint32_t{0});
}

std::vector<ChunkBytes> encode_chunk(const Piece& piece, const Index3& offset, std::int64_t edge,
                                     std::span<const StoredChannel> channels, Depth depth) {
  const auto size = static_cast<std::size_t>(edge * edge * edge);
  std::vector<Values> values(channels.size(), Values(size));
  const std::int64_t y_end = std::min(edge, piece.size[1] - offset[1]);
  for (std::int64_t y = 0; y < y_end; ++y)
    for (std::size_t i = 0; i < channels.size(); ++i)
      gather(piece, offset, edge, channels[i].source, y, values[i]);
  std::vector<ChunkBytes> chunks(channels.size());
  tbb::parallel_for(std::size_t{0}, channels.size(), [&](std::size_t i) {
    apply(channels[i].stored, values[i]);
    chunks[i] = compress_at(depth, values[i]);
  });
  return chunks;
}

}  // namespace solidtex::tools
