#include "engine/lattice/regions.h"

#include <algorithm>

namespace solidtex::engine {

namespace {

// Floor division by two, also below zero.
std::int64_t half(std::int64_t i) { return i >> 1; }

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

// The box of its inputs that one operation needs for a box of its output; one axis at a time.
struct InputRange {
  std::int64_t& lo;
  std::int64_t& hi;

  void operator()(const Conv3dOp& op) const {
    lo -= op.kernel / 2;
    hi += op.kernel / 2;
  }
  // o = 2 i + t - padding, 0 <= t < kernel: i from ceil((lo + padding - kernel + 1) / 2).
  void operator()(const ConvTranspose3dOp& op) const {
    lo = half(lo + op.padding - op.kernel + 2);
    hi = half(hi - 1 + op.padding) + 1;
  }
  void operator()(const UpsampleOp&) const {
    lo = half(lo);
    hi = half(hi - 1) + 1;
  }
  template <class ElementWise>
  void operator()(const ElementWise&) const {}
};

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
  Box needed = output;
  for (int axis = 0; axis < 3; ++axis) std::visit(InputRange{needed.lo[axis], needed.hi[axis]}, op);
  return needed;
}

}  // namespace solidtex::engine
