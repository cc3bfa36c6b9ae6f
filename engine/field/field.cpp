#include "engine/field/field.h"

#include "engine/field/block.h"
#include "engine/field/operations.h"
#include "engine/kernels/kernels.h"

namespace solidtex::engine {

namespace {

template <class... Visitors>
struct Overloaded : Visitors... {
  using Visitors::operator()...;
};
template <class... Visitors>
Overloaded(Visitors...) -> Overloaded<Visitors...>;

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

}  // namespace

Field::Field(FieldModel model, NoiseScheme scheme, std::uint64_t seed)
    : model_(std::move(model)), scheme_(scheme), seed_(seed), plans_(model_.nodes.size()) {
  plan_layers();
  plan_uses();
}

int Field::channels() const { return model_.nodes.back().channels; }

void Field::plan_layers() {
  for (std::size_t i = 0; i < plans_.size(); ++i) {
    const Op& op = model_.nodes[i].op;
    if (const auto* conv = std::get_if<Conv3dOp>(&op)) plans_[i].layer = pack(*conv);
    if (const auto* conv = std::get_if<ConvTranspose3dOp>(&op)) plans_[i].layer = pack(*conv);
    if (const auto* noise = std::get_if<NoiseOp>(&op))
      if (noise->distribution == Distribution::normal) require_normal(scheme_);
  }
}

// A leaky ReLU that alone reads a convolution is applied by the convolution: the same bits, and
// one pass through memory less.
void Field::plan_uses() {
  std::vector<int> uses(plans_.size(), 0);
  for (std::size_t i = 0; i < plans_.size(); ++i)
    for (const int input : model_.nodes[i].inputs) {
      ++uses[input];
      plans_[input].last_use = i;
    }
  for (std::size_t i = 0; i < plans_.size(); ++i) {
    const auto* relu = std::get_if<LeakyReluOp>(&model_.nodes[i].op);
    if (relu == nullptr) continue;
    const int input = model_.nodes[i].inputs[0];
    if (plans_[input].layer.outputs == 0 || uses[input] != 1) continue;
    plans_[input].layer.slope = relu->slope;
    plans_[i].fused = true;
  }
}

void Field::evaluate(const Box& box, float* values) const {
  if (box.empty()) return;
  const std::vector<Box> regions = required_regions(model_, box);
  std::vector<Block> blocks(regions.size());
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    blocks[i] = compute(i, regions[i], blocks);
    for (const int input : model_.nodes[i].inputs)
      if (plans_[input].last_use == i) blocks[input] = Block();
  }
  interleave(blocks.back(), values);
}

Block Field::compute(std::size_t index, const Box& region, std::vector<Block>& blocks) const {
  const Node& node = model_.nodes[index];
  const LinearLayer& layer = plans_[index].layer;
  if (plans_[index].fused) return std::move(blocks[node.inputs[0]]);
  const auto input = [&]() -> const Block& { return blocks[node.inputs[0]]; };
  // Element-wise results and convolutions keep the row pitch of their input.
  const std::ptrdiff_t row_pitch = node.inputs.size() == 1 &&
                                           !std::holds_alternative<UpsampleOp>(node.op) &&
                                           !std::holds_alternative<ConvTranspose3dOp>(node.op)
                                       ? input().volume().row_pitch
                                       : 0;
  Block out(region, node.channels, row_pitch);
  if (region.empty()) return out;
  const auto same_box = [&] { return input().view(region); };
  std::visit(
      Overloaded{
          [&](const NoiseOp& op) { fill_noise(scheme_, seed_, node.level, op.distribution, out); },
          [&](const Conv3dOp& op) {
            kernels::conv3d(layer, op.kernel, input().view(grown(region, op.kernel / 2)),
                            out.volume());
          },
          [&](const ConvTranspose3dOp& op) {
            kernels::conv_transpose3d(layer, {op.kernel, op.padding, input().box().lo, region.lo},
                                      input().volume(), out.volume());
          },
          [&](const UpsampleOp&) { upsample(input(), out); },
          [&](const ConcatOp&) {
            int channel = 0;
            for (const int source : node.inputs) {
              copy_channels(blocks[source], out, channel);
              channel += model_.nodes[source].channels;
            }
          },
          [&](const AffineOp& op) {
            kernels::affine(op.scale.values.data(), op.shift.values.data(), same_box(),
                            out.volume());
          },
          [&](const LeakyReluOp& op) { kernels::leaky_relu(op.slope, same_box(), out.volume()); },
          [&](const TanhOp&) { kernels::tanh(same_box(), out.volume()); },
          [&](const SigmoidOp&) { kernels::sigmoid(same_box(), out.volume()); }},
      node.op);
  return out;
}

}  // namespace solidtex::engine
