// A volume evaluated slab after slab along one axis, each in parallel blocks: memory stays bounded
// by one slab.
#pragma once

#include <functional>
#include <span>

#include "tools/bake/volume.h"
#include "tools/common/progress.h"

namespace solidtex::tools {

struct Slab {
  Index3 offset, size;            // relative to the volume's origin
  std::span<const float> values;  // [x][y][z][channel]
};

// Block edge that keeps all threads busy and a slab within 1 GiB.
std::int64_t choose_block(const Volume& volume, int axis, int threads);

// Calls `take` for every slab in order. Throws Interrupted after Ctrl-C.
void for_each_slab(const Volume& volume, int axis, std::int64_t block, Progress& progress,
                   const std::function<void(const Slab&)>& take);

}  // namespace solidtex::tools
