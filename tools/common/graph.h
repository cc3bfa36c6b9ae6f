// The lattice family's graph as a table: what the document leaves implicit, made explicit.
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
  // Voxels of this node that one output voxel can need, along each axis, relative to the voxel of
  // the node's level that contains it; for the worst position of the output voxel.
  std::int64_t region_low = 0, region_high = 0;
};

// `field`: that part of a document which the engine has accepted.
std::vector<GraphNode> describe_graph(const nlohmann::json& field);

}  // namespace solidtex::tools
