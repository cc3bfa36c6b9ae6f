// Edge dilation: extends the charts of an atlas.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "plugins/mesh/atlas.h"

namespace solidtex::mesh {

inline constexpr std::uint32_t kUncovered = std::numeric_limits<std::uint32_t>::max();

// Returns for each texel [y][x] of a region the index of the nearest texel of `wide` that is not
// kUncovered and at most `margin` texels away, or kUncovered. `wide` extends `margin` texels beyond
// the region, or to the edge of the atlas. Ties are broken the same way in every region.
std::vector<std::uint32_t> nearest_covered(const std::vector<std::uint32_t>& triangles,
                                           const AtlasRegion& wide, const AtlasRegion& region,
                                           int margin);

}  // namespace solidtex::mesh
