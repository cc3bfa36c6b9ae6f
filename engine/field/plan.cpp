#include "engine/field/plan.h"

#include <variant>

namespace solidtex::engine {

namespace {

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
  explicit Planner(const FieldModel& model) : nodes_(model.nodes), readers_(nodes_.size()) {
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      for (const int input : nodes_[i].inputs) readers_[input].push_back(static_cast<int>(i));
  }

  Plan run() {
    plan_.parts.resize(nodes_.size());
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

  // Makes the chain that begins with a 3^3 convolution; gives its last node.
  int extend_chain(int node, ConvChain& chain) {
    const auto& conv = std::get<Conv3dOp>(nodes_[node].op);
    chain.first =
        WinogradLayer(inputs_of(node), nodes_[node].channels, conv.weight.values, conv.bias.values);
    float* slope = &chain.first.slope;  // of the last layer so far
    while (readers_[node].size() == 1) {
      const int next = readers_[node][0];
      if (const auto* relu = std::get_if<LeakyReluOp>(&nodes_[next].op); relu && *slope == 1) {
        *slope = relu->slope;
      } else if (const auto* point = std::get_if<Conv3dOp>(&nodes_[next].op);
                 point && point->kernel == 1) {
        chain.rest.emplace_back(inputs_of(next), nodes_[next].channels, point->weight.values,
                                point->bias.values);
        slope = &chain.rest.back().slope;
      } else {
        break;
      }
      plan_.parts[next] = {next};  // not a step of its own
      node = next;
    }
    return node;
  }

  int inputs_of(int node) const { return nodes_[nodes_[node].inputs[0]].channels; }

  const std::vector<Node>& nodes_;
  std::vector<std::vector<int>> readers_;
  Plan plan_;
};

}  // namespace

Plan make_plan(const FieldModel& model) { return Planner(model).run(); }

}  // namespace solidtex::engine
