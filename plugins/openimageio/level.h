// One level of detail of an image: its voxels, and their values.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <solidtex/solidtex.hpp>

#include "plugins/openimageio/query.h"

namespace solidtex::openimageio {

// Voxels [low, high) of a level, from the image's own corner.
struct Region {
  std::array<int, 3> low{}, high{};

  int size(std::size_t axis) const { return high[axis] - low[axis]; }
  std::size_t voxel_count() const {
    return static_cast<std::size_t>(size(0)) * static_cast<std::size_t>(size(1)) *
           static_cast<std::size_t>(size(2));
  }
};

// Level n has voxels of 2^n texels along an edge. Those of level 0 are the texture's own. Others
// are means over their cubes, in light, as far as solidtex_eval_filtered knows them: where the
// origin is a multiple of 2^n these are the engine's own means up to n = 3, and above it what it
// predicts.
class Level {
 public:
  Level(const Query& query, int lod);

  int lod() const { return lod_; }
  const std::array<int, 3>& size() const { return size_; }  // voxels
  const std::array<int, 3>& tile() const { return tile_; }
  // Row vectors: a point of the host's world to [0,1]^3 over the image, as OpenImageIO wants it.
  std::array<float, 16> world_to_local() const;

  // Values of a region, index order [z][y][x][channel]. It may reach beyond the image: the texture
  // goes on there. Queries run on the calling thread's oneTBB arena. Throws solidtex::error.
  void evaluate(const texture& texture, const Region& region, float* values) const;

 private:
  void evaluate_texels(const texture& texture, const Region& region, float* values) const;
  void evaluate_means(const texture& texture, const Region& region, float* values) const;

  int lod_;
  std::array<int, 3> size_{}, tile_{};
  std::array<std::int64_t, 3> origin_;
  double scale_;
};

}  // namespace solidtex::openimageio
