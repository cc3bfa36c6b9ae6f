// How a graph is evaluated: which nodes are computed together, and where their inputs are found.
#pragma once

#include <vector>

#include "engine/kernels/linear_layer.h"
#include "engine/kernels/winograd.h"
#include "engine/model/model.h"

namespace solidtex::engine {

struct Step {
  // The values of a node that is kept in a ring of its own.
  int node = 0;
  // The node that reads the inputs: the same, but for the first convolution of a chain.
  int first = 0;
  // A 3^3 convolution with the activations and 1^3 convolutions that alone follow it.
  ConvChain chain;
  // The packed weights of any other convolution.
  LinearLayer layer;

  bool is_chain() const { return chain.outputs() > 0; }
};

struct Plan {
  std::vector<Step> steps;  // in the order of evaluation
  // For each node, the nodes whose windows hold its channels: itself, the parts of a
  // concatenation, the end of a chain.
  std::vector<std::vector<int>> parts;
  // For each node, where the tiles begin that it is computed in.
  std::vector<int> tile_origins;
};

Plan make_plan(const LatticeModel& model);

}  // namespace solidtex::engine
