// Bounds the regions and the work that one voxel needs.
//
// Kernels in a chain widen the region a little each. Thousands of them, each of them legal, would
// need more memory than there is. Regions here are those of the worst position of the voxel.
#include <algorithm>
#include <optional>

#include "engine/model/operations.h"
#include "engine/model/readers.h"

namespace solidtex::engine {
namespace {

constexpr std::int64_t max_values = std::int64_t{1} << 26;
constexpr std::int64_t max_work = std::int64_t{1} << 36;

// Returns the region of a node's input. A region is relative to the voxel of its level that
// contains the output voxel. On a coarser level this voxel is either half of its coarse voxel: both
// count.
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
    const Range region = *regions[i];  // a later node uses every node
    const std::int64_t extent = region.hi - region.lo;
    // Checked node by node, so that the sums cannot overflow.
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
