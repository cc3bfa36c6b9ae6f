// Levels of detail, shards and chunks of a Zarr store.
#pragma once

#include <cstdint>
#include <filesystem>

#include "tools/bake/volume.h"

namespace solidtex::tools {

struct Box {
  Index3 offset, size;
};

// A shard of level k covers the same voxels of level 0 as the shard at its position of any other
// level, so that one pass over them makes all levels, and no shard needs another.
struct StoreLayout {
  Index3 size;              // voxels of level 0
  std::int64_t shard_edge;  // of level 0; a power of two
  std::int64_t channels;

  int level_count() const;
  Index3 level_size(int level) const;
  std::int64_t shard_edge_of(int level) const { return shard_edge >> level; }
  std::int64_t chunk_edge(int level) const;
  std::int64_t chunks_along_edge(int level) const {
    return shard_edge_of(level) / chunk_edge(level);
  }

  std::int64_t shard_count() const;
  Index3 shard_position(std::int64_t shard) const;

  // Voxels of a shard inside of the volume, as a box of its level.
  Box shard_box(int level, const Index3& position) const;

  // Path in the store: "2/c/0/Z/Y/X".
  std::filesystem::path shard_path(int level, const Index3& position) const;
};

inline constexpr std::int64_t min_shard_edge = 16, max_shard_edge = 1024;

// An eighth of a small cube, or as much as fits in memory with its levels.
std::int64_t default_shard_edge(const Index3& size);

}  // namespace solidtex::tools
