#include "engine/lattice/plan.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "engine/lattice/regions.h"

namespace solidtex::engine {

namespace {

constexpr int kMaxDirectInputs = 4;
constexpr std::int64_t kAligned = 64;

LinearLayer pack(const Conv3dOp& op) {
  const auto outputs = static_cast<int>(op.weight.shape[0]);
  const auto terms = static_cast<int>(op.weight.values.size() / op.weight.shape[0]);
  return LinearLayer(outputs, terms, op.bias.values, [&](int o, int t) {
    return op.weight.values[static_cast<std::size_t>(o) * terms + t];
  });
}

LinearLayer pack(const ConvTranspose3dOp& op) {
  const auto inputs = static_cast<int>(op.weight.shape[0]);
  const auto outputs = static_cast<int>(op.weight.shape[1]);
  const int taps = op.kernel * op.kernel * op.kernel;
  return LinearLayer(outputs, inputs * taps, op.bias.values, [&](int o, int t) {
    const auto row = static_cast<std::size_t>(t / taps) * outputs + o;
    return op.weight.values[row * taps + t % taps];
  });
}

class Planner {
 public:
  explicit Planner(const LatticeModel& model)
      : nodes_(model.nodes),
        readers_(nodes_.size()),
        aligned_(required_regions(model, {{0, 0, 0}, {kAligned, kAligned, kAligned}})) {
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      for (const int input : nodes_[i].inputs) readers_[input].push_back(static_cast<int>(i));
  }

  Plan run() {
    plan_.parts.resize(nodes_.size());
    plan_.tile_origins.resize(nodes_.size());
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      if (plan_.parts[i].empty()) add(static_cast<int>(i));
    return std::move(plan_);
  }

 private:
  void add(int node) {
    const Op& op = nodes_[node].op;
    if (std::holds_alternative<ConcatOp>(op)) {
      for (const int input : nodes_[node].inputs)
        for (const int part : plan_.parts[input]) plan_.parts[node].push_back(part);
      return;
    }
    Step step{node, node, {}, {}};
    if (const auto* conv = std::get_if<Conv3dOp>(&op); conv && conv->kernel == 3)
      step.node = extend_chain(node, step.chain);
    else if (conv)
      step.layer = pack(*conv);
    else if (const auto* transposed = std::get_if<ConvTranspose3dOp>(&op))
      step.layer = pack(*transposed);
    plan_.parts[step.node] = {step.node};
    plan_.steps.push_back(std::move(step));
  }

  // Makes the chain that begins with a 3^3 convolution. Returns its last node.
  int extend_chain(int first, ConvChain& chain) {
    float negative_slope = 1;  // of the 3^3 convolution
    float* last_slope = &negative_slope;
    int node = first;
    while (readers_[node].size() == 1) {
      const int next = readers_[node][0];
      if (const auto* relu = std::get_if<LeakyReluOp>(&nodes_[next].op); relu && *last_slope == 1) {
        *last_slope = relu->negative_slope;
      } else if (const auto* point = std::get_if<Conv3dOp>(&nodes_[next].op);
                 point && point->kernel == 1) {
        chain.rest.emplace_back(inputs_of(next), nodes_[next].channels, point->weight.values,
                                point->bias.values);
        last_slope = &chain.rest.back().negative_slope;
      } else {
        break;
      }
      plan_.parts[next] = {next};  // no step of its own
      node = next;
    }
    const bool gives_result = node + 1 == static_cast<int>(nodes_.size());
    begin_chain(first, gives_result, chain);
    (chain.is_direct() ? chain.taps.negative_slope : chain.first.negative_slope) = negative_slope;
    plan_.tile_origins[first] = chain.origin;
    for (int inner = first; inner != node; plan_.tile_origins[inner] = chain.origin)
      inner = readers_[inner][0];
    return node;
  }

  // Few inputs are summed tap by tap. Tiles of four need whole tiles of their inputs, so only the
  // result uses them: elsewhere they would widen margins.
  void begin_chain(int node, bool gives_result, ConvChain& chain) const {
    const auto& conv = std::get<Conv3dOp>(nodes_[node].op);
    std::vector<bool> upsampled;  // [input]
    const std::vector<int>& parts = plan_.parts[nodes_[node].inputs[0]];
    for (const int part : parts)
      upsampled.insert(upsampled.end(), static_cast<std::size_t>(nodes_[part].channels),
                       std::holds_alternative<UpsampleOp>(nodes_[part].op));
    const bool any_upsampled = std::ranges::find(upsampled, true) != upsampled.end();
    chain.origin = any_upsampled ? 1 : static_cast<int>(aligned_[node].lo[0] & 1);
    if (inputs_of(node) <= kMaxDirectInputs && parts.size() == 1 && !any_upsampled)
      chain.taps = pack(conv);
    else
      chain.first = WinogradLayer(gives_result && !any_upsampled ? 4 : 2, std::move(upsampled),
                                  nodes_[node].channels, conv.weight.values, conv.bias.values);
  }

  int inputs_of(int node) const { return nodes_[nodes_[node].inputs[0]].channels; }

  const std::vector<Node>& nodes_;
  std::vector<std::vector<int>> readers_;
  std::vector<Box> aligned_;  // regions of an aligned block
  Plan plan_;
};

}  // namespace

Plan make_plan(const LatticeModel& model) { return Planner(model).run(); }

}  // namespace solidtex::engine
