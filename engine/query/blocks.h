// Splits a box into blocks along planes of the absolute lattice.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "engine/common/box.h"

namespace solidtex::engine {

// Returns floor(a / b) for b > 0.
constexpr std::int64_t floor_div(std::int64_t a, std::int64_t b) {
  return a / b - (a % b < 0 ? 1 : 0);
}

// The blocks into which multiples of `size` cut a box, in the order [x][y][z].
class BlockSplit {
 public:
  BlockSplit(const Box& box, const std::array<std::int64_t, 3>& size);

  std::size_t count() const { return count_[0] * count_[1] * count_[2]; }
  Box block(std::size_t index) const;

 private:
  Box box_;
  std::array<std::int64_t, 3> size_;
  std::array<std::int64_t, 3> first_{};
  std::array<std::size_t, 3> count_{};
};

}  // namespace solidtex::engine
