#include "engine/model/operations.h"

namespace solidtex::engine {
namespace {

// Returns floor(i / 2).
std::int64_t half(std::int64_t i) { return i >> 1; }

// A transposed convolution of stride 2 has o = 2 i + t - padding with 0 <= t < kernel: i begins at
// ceil((lo + padding - kernel + 1) / 2).
Range transposed(Range output, int kernel, int padding) {
  return {half(output.lo + padding - kernel + 2), half(output.hi - 1 + padding) + 1};
}

struct RequiredInput {
  Range output;

  Range operator()(const Conv3dOp& op) const {
    return {output.lo - op.kernel / 2, output.hi + op.kernel / 2};
  }
  Range operator()(const ConvTranspose3dOp& op) const {
    return transposed(output, op.kernel, op.padding);
  }
  Range operator()(const UpsampleOp&) const { return transposed(output, 2, 0); }
  template <class ElementWise>
  Range operator()(const ElementWise&) const {
    return output;
  }
};

std::int64_t weight_count(const Tensor& weight) {
  std::int64_t count = 1;
  for (const std::int64_t extent : weight.shape) count *= extent;
  return count;
}

}  // namespace

Range required_input(const Op& op, Range output) { return std::visit(RequiredInput{output}, op); }

std::int64_t operations_per_voxel(const Node& node) {
  if (const auto* conv = std::get_if<Conv3dOp>(&node.op)) return weight_count(conv->weight);
  if (const auto* conv = std::get_if<ConvTranspose3dOp>(&node.op))
    return weight_count(conv->weight);
  return node.channels;
}

}  // namespace solidtex::engine
