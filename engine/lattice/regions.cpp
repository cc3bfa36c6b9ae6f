#include "engine/lattice/regions.h"

#include <algorithm>

#include "engine/model/operations.h"

namespace solidtex::engine {

namespace {

Box unite(const Box& a, const Box& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  Box hull;
  for (int axis = 0; axis < 3; ++axis) {
    hull.lo[axis] = std::min(a.lo[axis], b.lo[axis]);
    hull.hi[axis] = std::max(a.hi[axis], b.hi[axis]);
  }
  return hull;
}

}  // namespace

std::vector<Box> required_regions(const LatticeModel& model, const Box& output,
                                  std::span<const int> tile_origins) {
  std::vector<Box> regions(model.nodes.size());
  if (regions.empty()) return regions;
  regions.back() = output;
  for (std::size_t i = regions.size(); i-- > 0;) {
    const Node& node = model.nodes[i];
    if (regions[i].empty()) continue;
    if (!tile_origins.empty()) {
      const std::int64_t origin = tile_origins[i], last = node.level > 0 ? 3 : 1;
      regions[i].hi[0] = ((regions[i].hi[0] - origin + last) & ~last) + origin;
    }
    const Box needed = required_input(node.op, regions[i]);
    for (const int input : node.inputs) regions[input] = unite(regions[input], needed);
  }
  return regions;
}

Box required_input(const Op& op, const Box& output) {
  Box needed;
  for (int axis = 0; axis < 3; ++axis) {
    const Range range = required_input(op, Range{output.lo[axis], output.hi[axis]});
    needed.lo[axis] = range.lo;
    needed.hi[axis] = range.hi;
  }
  return needed;
}

}  // namespace solidtex::engine
