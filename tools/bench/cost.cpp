#include "tools/bench/cost.h"

#include <cmath>

#include "tools/common/graph.h"

namespace solidtex::tools {
namespace {

using nlohmann::json;

double taps(const json& node) { return std::pow(node.at("kernel").get<double>(), 3); }

double lattice_multiply_adds(const json& lattice) {
  const std::vector<GraphNode> nodes = describe_graph(lattice);
  double sum = 0;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const json& description = lattice.at("nodes")[i];
    const GraphNode& node = nodes[i];
    if (node.op != "conv3d" && node.op != "conv_transpose3d") continue;
    const auto inputs = static_cast<double>(nodes[node.inputs.front()].channels);
    double own = inputs * static_cast<double>(node.channels) * taps(description);
    if (node.op == "conv_transpose3d") own /= 8;  // stride 2: an eighth of the taps reach an output
    sum += own * std::pow(0.125, static_cast<double>(node.level));
  }
  return sum;
}

// Layer 0 reads a constant, which costs nothing a point. Every layer but the last hidden one reads
// octaves.
double sampler_multiply_adds(const json& sampler, double channels) {
  const double octaves = sampler.at("octaves"), layers = sampler.at("hidden_layers"),
               width = sampler.at("width");
  return (layers - 1) * width * width + octaves * width + width * channels;
}

}  // namespace

double direct_multiply_adds(const json& document) {
  if (document.at("family") == "field") return lattice_multiply_adds(document.at("field"));
  return sampler_multiply_adds(document.at("sampler"),
                               static_cast<double>(document.at("channels").size()));
}

}  // namespace solidtex::tools
