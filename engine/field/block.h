// A node's values on a box of its level: memory, and the view of it that kernels take.
#pragma once

#include <hwy/aligned_allocator.h>

#include "engine/field/box.h"
#include "engine/kernels/volume.h"

namespace solidtex::engine {

class Block {
 public:
  Block() = default;

  // Rows are at least as long as asked: a convolution keeps its input's row pitch, so that a whole
  // plane is one run of contiguous values for both.
  Block(const Box& box, int channels, std::ptrdiff_t row_pitch = 0);

  const Box& box() const { return box_; }
  const Volume& volume() const { return volume_; }

 private:
  Box box_;
  Volume volume_;
  hwy::AlignedFreeUniquePtr<float[]> values_;
};

}  // namespace solidtex::engine
