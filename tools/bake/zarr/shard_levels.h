// All levels of one shard, made in one pass over its voxels.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "tools/bake/pieces.h"
#include "tools/bake/zarr/background_writer.h"
#include "tools/bake/zarr/shard_file.h"

namespace solidtex::tools {

// Takes a shard's pieces, ordered by x. Compresses their chunks, hands them to the writer, and
// averages them to the next level, of which it holds one layer of chunks.
class ShardLevels {
 public:
  ShardLevels(const std::filesystem::path& folder, const StoreLayout& layout,
              const Index3& position, const Output& output, const Volume& volume,
              BackgroundWriter& writer);

  // The largest piece: whole chunks along each axis, and all of z.
  Index3 piece_size() const;

  // `offset` of the piece is relative to the shard. Values are the model's own.
  void take(const Piece& piece);
  void finish();

  // Bytes in memory, less the writer's queue.
  static double memory(const StoreLayout& layout, const Volume& volume);

 private:
  struct Level {
    std::shared_ptr<ShardFile> file;
    Index3 size;        // of the shard in this level
    std::int64_t edge;  // of a chunk
    Index3 layer_offset{}, layer_size{};
    std::vector<float> layer;  // linear light
    std::size_t missing = 0;   // voxels of the layer that have not come yet
  };

  void begin_layer(Level& level, std::int64_t x);
  void process(std::size_t level, const Piece& piece);
  void store(std::size_t level, const Piece& piece);
  void average(std::size_t level, const Piece& piece);

  std::vector<Level> levels_;
  std::vector<StoredChannel> model_, light_;  // of level 0, whose values are the model's; of others
  Depth depth_;
  std::size_t model_channels_;
  BackgroundWriter& writer_;
};

}  // namespace solidtex::tools
