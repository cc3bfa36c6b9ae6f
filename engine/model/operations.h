// The operations of the lattice family: the one home of their receptive fields and their cost.
#pragma once

#include <cstdint>

#include "engine/model/model.h"

namespace solidtex::engine {

// Coordinates lo <= i < hi on one axis.
struct Range {
  std::int64_t lo = 0, hi = 0;
};

// Returns the inputs that an operation reads on one axis for a range of outputs. All axes have the
// same rule.
Range required_input(const Op& op, Range output);

// Returns the multiply-adds per voxel of a node, at least one per channel.
std::int64_t operations_per_voxel(const Node& node);

}  // namespace solidtex::engine
