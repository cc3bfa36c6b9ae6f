#include "plugins/mesh/dilation.h"

#include <cstddef>

namespace solidtex::mesh {
namespace {

// How far it is, in one row, to the nearest covered texel: to the left where both are as near.
std::vector<int> steps_in_rows(const std::vector<std::uint32_t>& triangles, std::size_t width,
                               int none) {
  std::vector<int> steps(triangles.size(), none);
  for (std::size_t row = 0; row < triangles.size(); row += width) {
    int left = none;
    for (std::size_t x = 0; x < width; ++x) {
      left = triangles[row + x] != kUncovered ? 0 : left == none ? none : left - 1;
      steps[row + x] = left;
    }
    int right = none;
    for (std::size_t x = width; x-- > 0;) {
      right = triangles[row + x] != kUncovered ? 0 : right == none ? none : right + 1;
      int& nearest = steps[row + x];
      if (right != none && (nearest == none || right < -nearest)) nearest = right;
    }
  }
  return steps;
}

}  // namespace

std::vector<std::uint32_t> nearest_covered(const std::vector<std::uint32_t>& triangles,
                                           const AtlasRegion& wide, const AtlasRegion& region,
                                           int margin) {
  constexpr int kNone = std::numeric_limits<int>::max();
  const auto width = static_cast<std::size_t>(wide.width());
  const std::vector<int> steps = steps_in_rows(triangles, width, kNone);
  std::vector<std::uint32_t> sources;
  for (int y = region.low[1]; y < region.high[1]; ++y)
    for (int x = region.low[0]; x < region.high[0]; ++x) {
      std::uint32_t source = kUncovered;
      int nearest = margin * margin + 1;  // squared
      const auto look_at_row = [&](int row) {
        if (row < wide.low[1] || row >= wide.high[1]) return;
        const std::size_t at = static_cast<std::size_t>(row - wide.low[1]) * width +
                               static_cast<std::size_t>(x - wide.low[0]);
        const int step = steps[at];
        if (step == kNone || step > margin || step < -margin) return;
        const int distance = step * step + (row - y) * (row - y);
        if (distance >= nearest) return;
        nearest = distance;
        source = static_cast<std::uint32_t>(static_cast<std::ptrdiff_t>(at) + step);
      };
      look_at_row(y);
      for (int away = 1; away * away < nearest; ++away) {
        look_at_row(y - away);
        look_at_row(y + away);
      }
      sources.push_back(source);
    }
  return sources;
}

}  // namespace solidtex::mesh
