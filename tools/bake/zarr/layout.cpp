#include "tools/bake/zarr/layout.h"

#include <algorithm>
#include <bit>
#include <string>

namespace solidtex::tools {
namespace {

constexpr std::int64_t max_chunk_edge = 64;
constexpr std::int64_t coarsest_edge = 64;   // no further level below this size
constexpr std::int64_t min_level_edge = 16;  // of a shard: smaller ones are too many small files

std::int64_t divide_up(std::int64_t count, std::int64_t divisor) {
  return (count + divisor - 1) / divisor;
}

}  // namespace

int StoreLayout::level_count() const {
  int count = 1;
  while (std::ranges::max(level_size(count - 1)) > coarsest_edge &&
         shard_edge_of(count) >= min_level_edge)
    ++count;
  return count;
}

Index3 StoreLayout::level_size(int level) const {
  Index3 result = size;
  for (std::int64_t& extent : result) extent = divide_up(extent, std::int64_t{1} << level);
  return result;
}

std::int64_t StoreLayout::chunk_edge(int level) const {
  return std::min(max_chunk_edge, shard_edge_of(level));
}

std::int64_t StoreLayout::shard_count() const {
  std::int64_t count = 1;
  for (const std::int64_t extent : size) count *= divide_up(extent, shard_edge);
  return count;
}

Index3 StoreLayout::shard_position(std::int64_t shard) const {
  const std::int64_t x = divide_up(size[0], shard_edge), y = divide_up(size[1], shard_edge);
  return {shard % x, shard / x % y, shard / x / y};
}

Box StoreLayout::shard_box(int level, const Index3& position) const {
  const Index3 extent = level_size(level);
  const std::int64_t edge = shard_edge_of(level);
  Box box{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.offset[axis] = position[axis] * edge;
    box.size[axis] = std::min(edge, extent[axis] - box.offset[axis]);
  }
  return box;
}

std::filesystem::path StoreLayout::shard_path(int level, const Index3& position) const {
  const auto [x, y, z] = position;
  return std::filesystem::path(std::to_string(level)) / "c" / "0" / std::to_string(z) /
         std::to_string(y) / std::to_string(x);
}

std::int64_t default_shard_edge(const Index3& size) {
  const auto longest = static_cast<std::uint64_t>(std::ranges::max(size));
  return std::clamp(static_cast<std::int64_t>(std::bit_ceil(longest)) / 2, std::int64_t{64},
                    std::int64_t{512});
}

}  // namespace solidtex::tools
