// Edge dilation: what lies beside the parts of an atlas.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "plugins/mesh/atlas.h"

namespace solidtex::mesh {

inline constexpr std::uint32_t kUncovered = std::numeric_limits<std::uint32_t>::max();

// For each texel [y][x] of a region the index of the nearest one of `wide` that is not kUncovered:
// itself, or one at most `margin` texels away, or kUncovered where there is none. `wide` reaches
// that far beyond the region, or to the edge of the atlas. Of equally near ones the same is taken
// in every region.
std::vector<std::uint32_t> nearest_covered(const std::vector<std::uint32_t>& triangles,
                                           const AtlasRegion& wide, const AtlasRegion& region,
                                           int margin);

}  // namespace solidtex::mesh
