// One voxel must stay computable: bounds the regions that it needs and the work on them.
//
// Chained kernels grow the region by a few voxels each; thousands of them, each legal, would ask
// for more memory than there is. The regions here are those of the worst position of the voxel.
#include <algorithm>
#include <optional>

#include "engine/model/operations.h"
#include "engine/model/readers.h"

namespace solidtex::engine {
namespace {

constexpr std::int64_t max_values = std::int64_t{1} << 26;
constexpr std::int64_t max_work = std::int64_t{1} << 36;

// Returns the inputs that a node reads for `region`, coordinates relative to the voxel of its level
// that contains the output voxel, relative to that of the input's level. From one level to a
// coarser one the voxel is the first or the second half of its coarse voxel: what either reads.
Range worst_input(const Node& node, const Node& input, Range region) {
  if (input.level > node.level) ++region.hi;
  return required_input(node.op, region);
}

}  // namespace

void check_voxel_cost(const Fields& field, const std::vector<Node>& nodes) {
  std::vector<std::optional<Range>> regions(nodes.size());
  regions.back() = Range{0, 1};
  std::int64_t values = 0, work = 0;
  for (std::size_t i = nodes.size(); i-- > 0;) {
    const Range region = *regions[i];  // every node is used by a later one
    const std::int64_t extent = region.hi - region.lo;
    // Checked node by node, so that nothing can grow far enough to overflow.
    values += extent * extent * extent * nodes[i].channels;
    work += extent * extent * extent * operations_per_voxel(nodes[i]);
    if (values > max_values || work > max_work)
      throw invalid(field.label(),
                    field.path("nodes[" + std::to_string(i) + "] (" + show(nodes[i].name) + ")"),
                    std::to_string(values) + " values and " + std::to_string(work) +
                        " operations for one voxel",
                    "at most " + std::to_string(max_values) + " and " + std::to_string(max_work));
    for (const int input : nodes[i].inputs) {
      const auto index = static_cast<std::size_t>(input);
      const Range needed = worst_input(nodes[i], nodes[index], region);
      std::optional<Range>& known = regions[index];
      if (!known) known = needed;
      known->lo = std::min(known->lo, needed.lo);
      known->hi = std::max(known->hi, needed.hi);
    }
  }
}

}  // namespace solidtex::engine
