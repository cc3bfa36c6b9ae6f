#include "tools/common/graph.h"

#include <algorithm>
#include <map>

namespace solidtex::tools {
namespace {

using nlohmann::json;

void propagate_shape(const json& description, const std::vector<GraphNode>& nodes,
                     GraphNode& node) {
  if (node.inputs.empty()) {
    node.level = description.at("level");
    node.channels = node.op == "periodic" ? static_cast<int>(description.at("waves").size())
                                          : description.at("channels").get<int>();
    return;
  }
  node.level = nodes[node.inputs.front()].level;
  for (const std::size_t input : node.inputs) node.channels += nodes[input].channels;
  if (node.op == "upsample" || node.op == "conv_transpose3d") --node.level;
  if (description.contains("out_channels")) node.channels = description.at("out_channels");
}

std::int64_t floor_half(std::int64_t value) { return value >> 1; }

// Extends the input's region by what the node needs of it.
void extend_region(const json& description, const GraphNode& node, GraphNode& input) {
  std::int64_t low = node.region_low, high = node.region_high;
  if (node.op == "conv3d") {
    const std::int64_t radius = description.at("kernel").get<std::int64_t>() / 2;
    low -= radius;
    high += radius;
  } else if (node.op == "upsample" || node.op == "conv_transpose3d") {
    // Upsampling has the receptive field of a transposed convolution with kernel 2.
    const std::int64_t kernel = description.value("kernel", std::int64_t{2});
    const std::int64_t padding = description.value("padding", std::int64_t{0});
    low = floor_half(low + padding - kernel + 2);
    high = floor_half(high + 1 + padding);
  }
  input.region_low = std::min(input.region_low, low);
  input.region_high = std::max(input.region_high, high);
}

}  // namespace

std::vector<GraphNode> describe_graph(const json& lattice) {
  const json& descriptions = lattice.at("nodes");
  std::vector<GraphNode> nodes;
  std::map<std::string, std::size_t> indices;
  for (const json& description : descriptions) {
    GraphNode node;
    node.name = description.at("name");
    node.op = description.at("op");
    if (description.contains("inputs"))
      for (const json& input : description.at("inputs")) node.inputs.push_back(indices.at(input));
    propagate_shape(description, nodes, node);
    indices[node.name] = nodes.size();
    nodes.push_back(std::move(node));
  }
  for (std::size_t i = nodes.size(); i-- > 0;)
    for (const std::size_t input : nodes[i].inputs)
      extend_region(descriptions[i], nodes[i], nodes[input]);
  return nodes;
}

}  // namespace solidtex::tools
