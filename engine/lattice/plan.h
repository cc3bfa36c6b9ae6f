// Evaluation plan of a graph: which nodes are computed together and where their inputs are kept.
#pragma once

#include <vector>

#include "engine/kernels/linear_layer.h"
#include "engine/kernels/winograd.h"
#include "engine/model/model.h"

namespace solidtex::engine {

struct Step {
  // Node whose values the ring of this step keeps.
  int node = 0;
  // Node that reads the inputs: `node` itself, or the first convolution of a chain.
  int first = 0;
  // A 3^3 convolution and the activations and 1^3 convolutions that follow it alone.
  ConvChain chain;
  // Packed weights of any other convolution.
  LinearLayer layer;

  bool is_chain() const { return chain.outputs() > 0; }
};

struct Plan {
  std::vector<Step> steps;  // in the order of evaluation
  // For each node, the nodes whose rings hold its channels: itself, the parts of a concatenation,
  // or the end of its chain.
  std::vector<std::vector<int>> parts;
  // For each node, the origin of the tiles in which it is computed.
  std::vector<int> tile_origins;
};

Plan make_plan(const LatticeModel& model);

}  // namespace solidtex::engine
