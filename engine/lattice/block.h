// Values of a node on a box of its level.
#pragma once

#include <hwy/aligned_allocator.h>

#include <algorithm>
#include <new>

#include "engine/common/box.h"
#include "engine/kernels/volume.h"

namespace solidtex::engine {

class Block {
 public:
  Block() = default;

  // Rows are at least `row_pitch` long. A convolution keeps the row pitch of its input, so that a
  // plane is one contiguous run for both.
  Block(const Box& box, int channels, std::ptrdiff_t row_pitch = 0);

  const Box& box() const { return box_; }
  const Volume& volume() const { return volume_; }

 private:
  Box box_;
  Volume volume_;
  hwy::AlignedFreeUniquePtr<float[]> values_;
};

inline Block::Block(const Box& box, int channels, std::ptrdiff_t row_pitch) : box_(box) {
  volume_.channels = channels;
  if (box.empty()) return;
  for (int axis = 0; axis < 3; ++axis) volume_.size[axis] = box.size(axis);
  volume_.row_pitch = std::max<std::ptrdiff_t>(row_pitch, box.size(2));
  volume_.plane_pitch = volume_.row_pitch * box.size(1);
  volume_.channel_pitch = volume_.plane_pitch * box.size(0);
  values_ = hwy::AllocateAligned<float>(static_cast<std::size_t>(volume_.channel_pitch) * channels +
                                        kReadSlack);
  if (!values_) throw std::bad_alloc();
  volume_.data = values_.get();
}

}  // namespace solidtex::engine
