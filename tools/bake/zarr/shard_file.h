// Shard of a Zarr store: chunks one after another, then the index of their places and its CRC-32C.
// See "sharding_indexed" of the Zarr specification.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tools/bake/zarr/chunk.h"
#include "tools/bake/zarr/layout.h"
#include "tools/common/output_file.h"

namespace solidtex::tools {

// Appears under its name when it is complete and on the disk.
class ShardFile {
 public:
  // Removes what a killed process has left of this shard. Throws if another process writes it now.
  ShardFile(const std::filesystem::path& path, const StoreLayout& layout, int level);

  // `place` is the chunk's position in the shard.
  void append(std::size_t channel, const Index3& place, const ChunkBytes& bytes);
  void finish();

 private:
  AtomicFile atomic_;
  OutputFile file_;
  std::int64_t chunks_along_edge_;
  std::vector<std::uint64_t> index_;  // offset and size of each chunk
  std::uint64_t end_ = 0;
};

// Returns what is wrong with a shard, or an empty string. Reads all of it.
std::string shard_problem(const std::filesystem::path& path, const StoreLayout& layout, int level,
                          const Index3& position);

}  // namespace solidtex::tools
