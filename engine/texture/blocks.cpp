#include "engine/texture/blocks.h"

#include <algorithm>

namespace solidtex::engine {

BlockSplit::BlockSplit(const Box& box, std::int64_t edge) : box_(box), edge_(edge) {
  if (box.empty()) return;
  for (int axis = 0; axis < 3; ++axis) {
    first_[axis] = floor_div(box.lo[axis], edge);
    const std::int64_t last = floor_div(box.hi[axis] - 1, edge);
    count_[axis] = static_cast<std::size_t>(last - first_[axis] + 1);
  }
}

Box BlockSplit::block(std::size_t index) const {
  Box block;
  for (int axis = 2; axis >= 0; --axis) {
    const auto step = static_cast<std::int64_t>(index % count_[axis]);
    index /= count_[axis];
    const std::int64_t lo = (first_[axis] + step) * edge_;
    block.lo[axis] = std::max(lo, box_.lo[axis]);
    block.hi[axis] = std::min(lo + edge_, box_.hi[axis]);
  }
  return block;
}

void copy_block(const Box& block, const float* block_values, const Box& box, std::size_t channels,
                float* box_values) {
  const std::size_t row = static_cast<std::size_t>(block.size(2)) * channels;
  for (std::int64_t x = block.lo[0]; x < block.hi[0]; ++x) {
    for (std::int64_t y = block.lo[1]; y < block.hi[1]; ++y) {
      const std::int64_t voxel =
          ((x - box.lo[0]) * box.size(1) + (y - box.lo[1])) * box.size(2) + block.lo[2] - box.lo[2];
      std::copy_n(block_values, row, box_values + static_cast<std::size_t>(voxel) * channels);
      block_values += row;
    }
  }
}

}  // namespace solidtex::engine
