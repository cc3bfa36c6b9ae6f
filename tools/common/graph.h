// The graph of a lattice model as a table with shapes and receptive fields.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace solidtex::tools {

struct GraphNode {
  std::string name, op;
  std::vector<std::size_t> inputs;
  std::int64_t level = 0, channels = 0;
  // Receptive field of an output voxel in this node, along each axis, relative to the voxel of the
  // node's level that contains it; for the worst position of the output voxel.
  std::int64_t region_low = 0, region_high = 0;
};

// `lattice`: the part "field" of a document that the engine has accepted.
std::vector<GraphNode> describe_graph(const nlohmann::json& lattice);

}  // namespace solidtex::tools
