// One level of detail of an image.
#pragma once

#include <array>
#include <cstddef>
#include <solidtex/solidtex.hpp>

namespace solidtex::openimageio {

// Voxels [low, high) of a level, relative to the corner of the image.
struct Region {
  std::array<int, 3> low{}, high{};

  int size(std::size_t axis) const { return high[axis] - low[axis]; }
  std::size_t voxel_count() const {
    return static_cast<std::size_t>(size(0)) * static_cast<std::size_t>(size(1)) *
           static_cast<std::size_t>(size(2));
  }
};

class Level {
 public:
  virtual ~Level() = default;

  const std::array<int, 3>& size() const { return size_; }  // voxels
  const std::array<int, 3>& tile() const { return tile_; }

  // Values of a region, index order [z][y][x][channel]. The region may reach beyond the image.
  // Queries run on the calling thread's oneTBB arena. Throws solidtex::error.
  virtual void evaluate(const texture& texture, const Region& region, float* values) const = 0;

 protected:
  std::array<int, 3> size_{}, tile_{};
};

}  // namespace solidtex::openimageio
