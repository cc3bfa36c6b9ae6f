#include "engine/field/block.h"

#include <algorithm>
#include <new>

namespace solidtex::engine {

Block::Block(const Box& box, int channels, std::ptrdiff_t row_pitch) : box_(box) {
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
