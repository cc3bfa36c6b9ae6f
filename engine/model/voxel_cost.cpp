// One voxel must stay computable: bounds the regions that it needs and the work on them.
//
// Chained kernels grow the region by a few voxels each; thousands of them, each legal, would ask
// for more memory than there is. The regions here are those of the worst position of the voxel.
#include <algorithm>
#include <optional>

#include "engine/model/readers.h"

namespace solidtex::engine {
namespace {

constexpr std::int64_t max_values = std::int64_t{1} << 26;
constexpr std::int64_t max_work = std::int64_t{1} << 36;

// Voxels along each axis, relative to the voxel of the node's level that contains the output voxel.
struct Interval {
  std::int64_t low = 0, high = 0;
};

std::int64_t floor_half(std::int64_t value) { return value >> 1; }

// o is even or odd inside its coarse voxel; i = (o + padding - t) / 2 for taps t.
Interval needed_by_transpose(Interval output, std::int64_t kernel, std::int64_t padding) {
  return {floor_half(output.low + padding - kernel + 2), floor_half(output.high + 1 + padding)};
}

Interval needed(const Op& op, Interval output) {
  if (const auto* conv = std::get_if<Conv3dOp>(&op))
    return {output.low - conv->kernel / 2, output.high + conv->kernel / 2};
  if (const auto* conv = std::get_if<ConvTranspose3dOp>(&op))
    return needed_by_transpose(output, conv->kernel, conv->padding);
  if (std::holds_alternative<UpsampleOp>(op)) return needed_by_transpose(output, 2, 0);
  return output;
}

std::int64_t operations_per_voxel(const Node& node) {
  const auto taps = [](const Tensor& weight) {
    std::int64_t result = weight.shape[2] * weight.shape[3] * weight.shape[4];
    return result * weight.shape[0] * weight.shape[1];
  };
  if (const auto* conv = std::get_if<Conv3dOp>(&node.op)) return taps(conv->weight);
  if (const auto* conv = std::get_if<ConvTranspose3dOp>(&node.op)) return taps(conv->weight);
  return node.channels;
}

}  // namespace

void check_voxel_cost(const Fields& field, const std::vector<Node>& nodes) {
  std::vector<std::optional<Interval>> regions(nodes.size());
  regions.back() = Interval{};
  std::int64_t values = 0, work = 0;
  for (std::size_t i = nodes.size(); i-- > 0;) {
    const Interval region = *regions[i];  // every node is used by a later one
    const std::int64_t extent = region.high - region.low + 1;
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
      const Interval region_of_input = needed(nodes[i].op, region);
      auto& known = regions[static_cast<std::size_t>(input)];
      if (!known) known = region_of_input;
      known->low = std::min(known->low, region_of_input.low);
      known->high = std::max(known->high, region_of_input.high);
    }
  }
}

}  // namespace solidtex::engine
