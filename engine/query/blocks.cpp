#include "engine/query/blocks.h"

#include <algorithm>

namespace solidtex::engine {

BlockSplit::BlockSplit(const Box& box, const std::array<std::int64_t, 3>& size)
    : box_(box), size_(size) {
  if (box.empty()) return;
  for (int axis = 0; axis < 3; ++axis) {
    first_[axis] = floor_div(box.lo[axis], size[axis]);
    const std::int64_t last = floor_div(box.hi[axis] - 1, size[axis]);
    count_[axis] = static_cast<std::size_t>(last - first_[axis] + 1);
  }
}

Box BlockSplit::block(std::size_t index) const {
  Box block;
  for (int axis = 2; axis >= 0; --axis) {
    const auto step = static_cast<std::int64_t>(index % count_[axis]);
    index /= count_[axis];
    const std::int64_t lo = (first_[axis] + step) * size_[axis];
    block.lo[axis] = std::max(lo, box_.lo[axis]);
    block.hi[axis] = std::min(lo + size_[axis], box_.hi[axis]);
  }
  return block;
}

}  // namespace solidtex::engine
