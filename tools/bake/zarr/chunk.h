// Chunks of voxels as a Zarr store has them: [z][y][x] of a channel, compressed by Blosc, followed
// by their CRC-32C.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tools/bake/output.h"
#include "tools/bake/pieces.h"

namespace solidtex::tools {

using ChunkBytes = std::vector<unsigned char>;

inline constexpr int blosc_level = 5;
inline constexpr char blosc_compressor[] = "lz4";
inline constexpr char blosc_shuffle[] = "bitshuffle";

std::uint32_t crc32c(std::span<const unsigned char> bytes);

enum class Curve { none, encode, decode };  // of sRGB

// A channel of the store, as it is read from a piece.
struct StoredChannel {
  std::size_t source;  // channel of the piece
  Curve stored;        // makes the value of the store
  Curve averaged;      // makes light
};

// Encodes the chunk of `edge` voxels at `offset` in the piece, one chunk a channel. What lies
// beyond the piece is 0.
std::vector<ChunkBytes> encode_chunk(const Piece& piece, const Index3& offset, std::int64_t edge,
                                     std::span<const StoredChannel> channels, Depth depth);

}  // namespace solidtex::tools
