#include "plugins/transport/pore_space.h"

#include <algorithm>
#include <stdexcept>

namespace solidtex::transport {
namespace {

using Position = std::array<std::int64_t, 3>;

std::int64_t index_of(const Position& at, const Position& size) {
  return (at[0] * size[1] + at[1]) * size[2] + at[2];
}

Position position_of(std::int64_t index, const Position& size) {
  return {index / (size[1] * size[2]), index / size[2] % size[1], index % size[2]};
}

// Walks one component of pores through faces. Every voxel keeps in which copy of the image along
// the axis it was met: a second copy means that the component spans the period.
class Walk {
 public:
  Walk(const VoxelImage& image, int axis, Boundary boundary)
      : image_(image), axis_(axis), is_periodic_(boundary == Boundary::periodic) {
    const Position& size = image.size;
    const auto voxels = static_cast<std::size_t>(size[0] * size[1] * size[2]);
    conducts_.assign(voxels, 0);
    copy_.assign(voxels, kUnseen);
  }

  std::vector<std::uint8_t> run() {
    const auto voxels = static_cast<std::int64_t>(copy_.size());
    for (std::int64_t start = 0; start < voxels; ++start) {
      if (!image_.is_pore[start] || copy_[start] != kUnseen) continue;
      // A path from face to face has a pore on the first face.
      if (!is_periodic_ && position_of(start, image_.size)[axis_] != 0) continue;
      if (spans(start))
        for (const std::int64_t voxel : component_) conducts_[voxel] = 1;
    }
    return std::move(conducts_);
  }

 private:
  static constexpr std::int16_t kUnseen = std::numeric_limits<std::int16_t>::min();

  bool spans(std::int64_t start) {
    component_ = {start};
    copy_[start] = 0;
    bool found = false;
    for (std::size_t next = 0; next < component_.size(); ++next) {
      const std::int64_t voxel = component_[next];
      const Position at = position_of(voxel, image_.size);
      if (!is_periodic_ && at[axis_] == image_.size[axis_] - 1) found = true;
      for (int k = 0; k < 3; ++k)
        for (const int step : {-1, 1}) found |= visit(voxel, at, k, step);
    }
    return found;
  }

  // Returns whether the neighbor was met before in another copy.
  bool visit(std::int64_t from, Position at, int k, int step) {
    std::int16_t copy = copy_[from];
    at[k] += step;
    if (at[k] < 0 || at[k] >= image_.size[k]) {
      if (!is_periodic_) return false;
      at[k] -= step * image_.size[k];
      if (k == axis_) copy = static_cast<std::int16_t>(copy + step);
    }
    const std::int64_t voxel = index_of(at, image_.size);
    if (!image_.is_pore[voxel]) return false;
    if (copy_[voxel] != kUnseen) return copy_[voxel] != copy;
    copy_[voxel] = copy;
    component_.push_back(voxel);
    return false;
  }

  const VoxelImage& image_;
  int axis_;
  bool is_periodic_;
  std::vector<std::uint8_t> conducts_;
  std::vector<std::int16_t> copy_;
  std::vector<std::int64_t> component_;
};

}  // namespace

std::vector<std::uint8_t> conducting_voxels(const VoxelImage& image, int axis, Boundary boundary) {
  return Walk(image, axis, boundary).run();
}

std::int64_t count_conducting(const VoxelImage& image, int axis, Boundary boundary) {
  return std::ranges::count(conducting_voxels(image, axis, boundary), 1);
}

PoreSpace::PoreSpace(const VoxelImage& image, int axis, Boundary boundary)
    : size_(image.size), axis_(axis) {
  const std::vector<std::uint8_t> conducts = conducting_voxels(image, axis, boundary);
  repeats_.fill(boundary == Boundary::periodic);
  if (std::ranges::find(conducts, 1) == conducts.end()) return;
  numbers_.assign(conducts.size(), kSolid);
  for (std::size_t index = 0; index < numbers_.size(); ++index) {
    if (!conducts[index]) continue;
    if (positions_.size() == kSolid / 32)
      throw std::length_error("more than 134 million pore voxels, expected fewer: cut the volume");
    numbers_[index] = count();
    positions_.push_back(static_cast<std::int64_t>(index));
  }
}

Position PoreSpace::position(std::uint32_t pore) const {
  return position_of(positions_[pore], size_);
}

std::vector<int> PoreSpace::depths() const {
  std::vector<int> depths(count(), 0);
  std::vector<std::uint32_t> front;
  for (std::uint32_t pore = 0; pore < count(); ++pore)
    for (const Offset& face : kFaces)
      if (depths[pore] == 0 && neighbor(pore, face) == kSolid && !passes_open_end(pore, face)) {
        depths[pore] = 1;
        front.push_back(pore);
      }
  for (std::size_t next = 0; next < front.size(); ++next)
    for (const Offset& face : kFaces) {
      const std::uint32_t other = neighbor(front[next], face);
      if (other == kSolid || depths[other] != 0) continue;
      depths[other] = depths[front[next]] + 1;
      front.push_back(other);
    }
  std::ranges::replace(depths, 0, 1);  // no wall at all
  return depths;
}

std::uint32_t PoreSpace::neighbor(std::uint32_t pore, const Offset& offset) const {
  Position at = position(pore);
  for (int k = 0; k < 3; ++k) {
    at[k] += offset[k];
    if (at[k] >= 0 && at[k] < size_[k]) continue;
    if (!repeats_[k]) return kSolid;
    at[k] += at[k] < 0 ? size_[k] : -size_[k];
  }
  return numbers_[index_of(at, size_)];
}

}  // namespace solidtex::transport
