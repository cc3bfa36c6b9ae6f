#include "tools/bake/zarr/bake_store.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <iostream>
#include <mutex>
#include <stdexcept>
#include <vector>

#include "plugins/common/fingerprint.h"
#include "tools/bake/channels.h"
#include "tools/bake/zarr/shard_levels.h"
#include "tools/bake/zarr/store.h"
#include "tools/common/cli.h"
#include "tools/common/limits.h"
#include "tools/common/output_file.h"
#include "tools/common/progress.h"

namespace solidtex::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t max_queued_bytes = 32 << 20;

// The settings that the bytes of the store depend on.
nlohmann::ordered_json identity_of(const BakeOptions& options, const Output& output,
                                   const Volume& volume, const StoreLayout& layout) {
  Fingerprint of_model;
  of_model.add_content_of(volume.texture.path());
  nlohmann::ordered_json colors = nlohmann::ordered_json::object();
  for (const ChannelGroup& group : output.groups)
    colors[group.name] = encoding_name(output.encoding(group));
  nlohmann::ordered_json identity = {{"writer", "solidtex-bake"},
                                     {"version", solidtex::version()},
                                     {"model", fmt::format("{:016x}", of_model.value())},
                                     {"size", volume.size},
                                     {"origin", volume.origin},
                                     {"seed", volume.texture.seed()},
                                     {"precision", volume.texture.precision()},
                                     {"periodic", options.is_periodic},
                                     {"shard-size", layout.shard_edge},
                                     {"data type", data_type(output.depth)},
                                     {"channels", output.names},
                                     {"color space", colors},
                                     {"voxel-size", output.voxel_size.edges},
                                     {"unit", output.voxel_size.unit}};
  if (volume.texture.precision() != "full") identity["target"] = solidtex::target();
  return identity;
}

class StoreBake {
 public:
  StoreBake(const BakeOptions& options, const Volume& volume)
      : options_(options),
        folder_(options.output),
        volume_(volume),
        output_(resolve_output(options.request(), volume.texture)),
        layout_{volume.size,
                options.shard_size ? options.shard_size : default_shard_edge(volume.size),
                static_cast<std::int64_t>(output_.channels.size())} {}

  void run() {
    check_memory(folder_.string(), ShardLevels::memory(layout_, volume_) + max_queued_bytes,
                 "a smaller --shard-size needs less");
    check_range(volume_);
    if (!fs::exists(folder_))
      check_room(voxel_count(volume_.size) / static_cast<std::uint64_t>(options_.parts));
    open_store(folder_, output_, volume_, layout_,
               identity_of(options_, output_, volume_, layout_));
    const std::vector<std::int64_t> shards = missing_shards();
    check_room(voxels_of(shards));
    warn_of_disk(folder_, most_bytes(voxels_of(shards)),
                 "where it becomes full the bake stops, and the same command goes on when there is "
                 "room");
    Progress progress("Baking " + volume_.texture.name(), voxels_of(shards));
    BackgroundWriter writer(max_queued_bytes);
    for (const std::int64_t shard : shards) bake(shard, writer, progress);
    writer.finish();
    progress.finish();
  }

 private:
  // The shards of this part of the store: all, or with --shard I/N each N-th.
  std::vector<std::int64_t> own_shards() const {
    std::vector<std::int64_t> shards;
    for (std::int64_t i = options_.part - 1; i < layout_.shard_count(); i += options_.parts)
      shards.push_back(i);
    return shards;
  }

  std::vector<std::int64_t> missing_shards() const {
    const std::vector<std::int64_t> own = own_shards();
    std::vector<char> is_missing(own.size());
    tbb::parallel_for(std::size_t{0}, own.size(),
                      [&](std::size_t i) { is_missing[i] = is_complete(own[i]) ? 0 : 1; });
    throw_if_interrupted();
    std::vector<std::int64_t> missing;
    for (std::size_t i = 0; i < own.size(); ++i)
      if (is_missing[i]) missing.push_back(own[i]);
    if (missing.size() < own.size()) {
      say(fmt::format("{}: {} of {} shards are there and intact", folder_.string(),
                      own.size() - missing.size(), own.size()));
    }
    return missing;
  }

  bool is_complete(std::int64_t shard) const {
    const Index3 position = layout_.shard_position(shard);
    for (int level = 0; level < layout_.level_count(); ++level) {
      const fs::path path = folder_ / layout_.shard_path(level, position);
      if (interrupted() || !fs::exists(path)) return false;
      if (fs::is_directory(path))
        throw std::runtime_error(path.string() + ": found a folder, expected a shard; remove it");
      const std::string problem = shard_problem(path, layout_, level, position);
      if (problem.empty()) continue;
      std::cerr << fmt::format("{}: {}; it is made again\n", path.string(), problem);
      return false;
    }
    return true;
  }

  std::uint64_t voxels_of(const std::vector<std::int64_t>& shards) const {
    std::uint64_t voxels = 0;
    for (const std::int64_t shard : shards)
      voxels += voxel_count(layout_.shard_box(0, layout_.shard_position(shard)).size);
    return voxels;
  }

  // Compression halves no shipped model. A store that turns out larger ends with the error of a
  // full disk, and goes on when there is room.
  void check_room(std::uint64_t missing_voxels) const {
    const auto bytes = [&](std::uint64_t voxels) {
      return static_cast<double>(voxels) * static_cast<double>(output_.bytes_per_voxel()) / 2;
    };
    check_disk(folder_, bytes(missing_voxels),
               can_be_smaller(output_) ? "--depth 8 takes less" : "", Need::at_least);
    const Index3 largest = layout_.shard_box(0, {0, 0, 0}).size;
    check_file_size(folder_, bytes(voxel_count(largest)), "a smaller --shard-size writes less",
                    Need::at_least);
  }

  // What the levels take if nothing can be compressed: each has an eighth of the one before.
  double most_bytes(std::uint64_t voxels) const {
    return static_cast<double>(voxels) * static_cast<double>(output_.bytes_per_voxel()) * 8 / 7;
  }

  void bake(std::int64_t shard, BackgroundWriter& writer, Progress& progress) const {
    const Index3 position = layout_.shard_position(shard);
    const Box box = layout_.shard_box(0, position);
    ShardLevels levels(folder_, layout_, position, output_, volume_, writer);
    const Index3 step = levels.piece_size();
    std::vector<float> values;
    Piece piece{};
    auto& [x, y, z] = piece.offset;
    for (x = 0; x < box.size[0]; x += step[0]) {
      for (y = 0; y < box.size[1]; y += step[1]) {
        throw_if_interrupted();
        for (std::size_t axis = 0; axis < 3; ++axis)
          piece.size[axis] = std::min(step[axis], box.size[axis] - piece.offset[axis]);
        evaluate(box, piece, values);
        levels.take(piece);
        progress.advance(voxel_count(piece.size));
      }
    }
    levels.finish();
  }

  void evaluate(const Box& box, Piece& piece, std::vector<float>& values) const {
    Index3 offset{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      offset[axis] = box.offset[axis] + piece.offset[axis];
    tools::evaluate(volume_, offset, piece.size, values);
    piece.values = values;
  }

  const BakeOptions& options_;
  const fs::path folder_;
  const Volume volume_;
  const Output output_;
  const StoreLayout layout_;
};

[[noreturn]] void stop(const BakeOptions& options) {
  throw Interrupted(options.output.string() +
                    " keeps what is done: the same command goes on from there");
}

}  // namespace

bool is_store(const BakeOptions& options) {
  return options.mesh.empty() && !options.output.empty() &&
         format_of(options.request()).kind == FormatKind::zarr;
}

void check_store_options(const BakeOptions& options) {
  const std::string output = "-o " + options.output.string();
  if (is_store(options)) {
    if (options.block)
      throw std::runtime_error("--block: found it with " + output + ", expected --shard-size");
  } else if (options.parts > 1 || options.shard_size) {
    throw std::runtime_error((options.shard_size ? "--shard-size: found " : "--shard: found ") +
                             output + ", expected a name that ends in .zarr");
  }
}

void bake_store(const BakeOptions& options, const Volume& volume) {
  try {
    StoreBake(options, volume).run();
  } catch (const Interrupted&) {
    stop(options);
  } catch (const solidtex::error&) {  // Ctrl-C stops a query
    if (interrupted()) stop(options);
    throw;
  }
}

}  // namespace solidtex::tools
