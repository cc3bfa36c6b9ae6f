// The box of voxels to bake and the texture it comes from.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <solidtex/solidtex.hpp>

namespace solidtex::tools {

using Index3 = std::array<std::int64_t, 3>;

struct Volume {
  const solidtex::texture& texture;
  Index3 origin, size;

  std::size_t channels() const { return texture.channel_count(); }
};

inline std::size_t voxel_count(const Index3& size) {
  return static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
         static_cast<std::size_t>(size[2]);
}

// The voxel's number in [x][y][z].
inline std::size_t voxel_index(const Index3& size, const Index3& voxel) {
  return static_cast<std::size_t>((voxel[0] * size[1] + voxel[1]) * size[2] + voxel[2]);
}

}  // namespace solidtex::tools
