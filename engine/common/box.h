// Half-open box of lattice coordinates: lo <= i < hi on each axis.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace solidtex::engine {

struct Box {
  std::array<std::int64_t, 3> lo{}, hi{};

  std::int64_t size(int axis) const { return hi[axis] - lo[axis]; }
  bool empty() const { return size(0) <= 0 || size(1) <= 0 || size(2) <= 0; }
  std::size_t volume() const {
    if (empty()) return 0;
    return static_cast<std::size_t>(size(0)) * static_cast<std::size_t>(size(1)) *
           static_cast<std::size_t>(size(2));
  }
  friend bool operator==(const Box&, const Box&) = default;
};

}  // namespace solidtex::engine
