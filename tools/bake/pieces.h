// A volume evaluated piece after piece, so that memory stays bounded by one of them.
#pragma once

#include <functional>
#include <span>

#include "tools/bake/volume.h"
#include "tools/common/progress.h"

namespace solidtex::tools {

struct Piece {
  Index3 offset, size;            // relative to the volume's origin
  std::span<const float> values;  // [x][y][z][channel]
};

// The largest piece to ask for: at most 64 MiB where that leaves a sensible shape, long along x,
// where the lattice family evaluates plane after plane. At most `depth` voxels along z.
Index3 choose_piece(const Volume& volume, std::int64_t depth);

// Cuts the volume at multiples of `largest` (along x also at others, to hear Ctrl-C in time), the
// pieces with the same z one after another, and calls `take` for each. The library evaluates each
// in parallel. Throws Interrupted after Ctrl-C.
void for_each_piece(const Volume& volume, const Index3& largest, Progress& progress,
                    const std::function<void(const Piece&)>& take);

}  // namespace solidtex::tools
