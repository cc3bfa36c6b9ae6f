// The pores that conduct along an axis, numbered, with their neighbors.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "plugins/transport/transport.h"

namespace solidtex::transport {

using Offset = std::array<int, 3>;

// Offsets of the voxels that share a face, axis by axis: before, after.
inline constexpr std::array<Offset, 6> kFaces = {
    {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};

inline double voxels_of(const VoxelImage& image) {
  return static_cast<double>(image.size[0]) * static_cast<double>(image.size[1]) *
         static_cast<double>(image.size[2]);
}

class PoreSpace {
 public:
  static constexpr std::uint32_t kSolid = std::numeric_limits<std::uint32_t>::max();

  PoreSpace(const VoxelImage& image, int axis, Boundary boundary);

  std::uint32_t count() const { return static_cast<std::uint32_t>(positions_.size()); }
  int axis() const { return axis_; }
  bool repeats_along_axis() const { return repeats_[axis_]; }
  std::int64_t layers() const { return size_[axis_]; }  // along the axis
  std::array<std::int64_t, 3> position(std::uint32_t pore) const;
  // Number of the pore at an offset of at most one voxel an axis, or kSolid.
  std::uint32_t neighbor(std::uint32_t pore, const Offset& offset) const;
  // Which end of the axis lies between a pore and its neighbor: -1 the near one, 1 the far one, 0
  // none.
  int end_passed(std::uint32_t pore, const Offset& offset) const {
    const std::int64_t at = position(pore)[axis_] + offset[axis_];
    return at < 0 ? -1 : at >= size_[axis_] ? 1 : 0;
  }
  // Whether an open end of the axis lies between a pore and its neighbor.
  bool passes_open_end(std::uint32_t pore, const Offset& offset) const {
    return !repeats_along_axis() && end_passed(pore, offset) != 0;
  }
  // Steps from face to face to the nearest wall, 1 beside it. An open end is no wall.
  std::vector<int> depths() const;

 private:
  std::array<std::int64_t, 3> size_;
  int axis_;
  std::array<bool, 3> repeats_;
  std::vector<std::uint32_t> numbers_;   // of each voxel, kSolid where none conducts
  std::vector<std::int64_t> positions_;  // index of the voxel of each pore
};

// 1 for each voxel that conducts along the axis, see count_conducting.
std::vector<std::uint8_t> conducting_voxels(const VoxelImage& image, int axis, Boundary boundary);

}  // namespace solidtex::transport
