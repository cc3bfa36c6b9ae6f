// A box split into blocks along planes of the absolute lattice.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "engine/field/box.h"

namespace solidtex::engine {

// floor(a / b) for b > 0.
constexpr std::int64_t floor_div(std::int64_t a, std::int64_t b) {
  return a / b - (a % b < 0 ? 1 : 0);
}

// The blocks that multiples of `edge` cut a box into, in [x][y][z] order.
class BlockSplit {
 public:
  BlockSplit(const Box& box, std::int64_t edge);

  std::size_t count() const { return count_[0] * count_[1] * count_[2]; }
  Box block(std::size_t index) const;

 private:
  Box box_;
  std::int64_t edge_;
  std::array<std::int64_t, 3> first_{};
  std::array<std::size_t, 3> count_{};
};

// Copies a block's values, all in [x][y][z][channel] order, to their place in those of the box.
void copy_block(const Box& block, const float* block_values, const Box& box, std::size_t channels,
                float* box_values);

}  // namespace solidtex::engine
