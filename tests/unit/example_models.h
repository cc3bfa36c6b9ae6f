// Models built in memory: the generator of Gutierrez et al., a small graph with every operation,
// and a sampler. Weights are random and the same in every run.
#pragma once

#include <cmath>
#include <random>

#include "engine/model/model.h"

namespace example {

namespace se = solidtex::engine;

class Weights {
 public:
  explicit Weights(unsigned seed) : random_(seed) {}

  // Uniform in [-limit, limit]. A limit of 0 scales by fan-in.
  se::Tensor operator()(std::vector<std::int64_t> shape, float limit = 0) {
    se::Tensor tensor{shape, {}};
    std::size_t count = 1;
    for (const auto extent : shape) count *= static_cast<std::size_t>(extent);
    if (limit == 0)
      limit = std::sqrt(6.0f * static_cast<float>(shape[0]) / static_cast<float>(count));
    std::uniform_real_distribution<float> value(-limit, limit);
    for (std::size_t i = 0; i < count; ++i) tensor.values.push_back(value(random_));
    return tensor;
  }

 private:
  std::mt19937 random_;
};

// Appends nodes to a graph. Each function returns the index of the new node.
class LatticeBuilder {
 public:
  explicit LatticeBuilder(unsigned seed) : weights_(seed) {}

  int noise(int level, int channels, se::Distribution distribution = se::Distribution::uniform) {
    return add(se::NoiseOp{distribution}, {}, level, channels);
  }
  int periodic(int level, std::vector<se::Wave> waves) {
    const int channels = static_cast<int>(waves.size());
    return add(se::PeriodicOp{std::move(waves)}, {}, level, channels);
  }
  int conv(int input, int channels, int kernel) {
    const int inputs = node(input).channels;
    se::Conv3dOp op{kernel, weights_({channels, inputs, kernel, kernel, kernel}),
                    weights_({channels}, 0.1f)};
    return add(op, {input}, node(input).level, channels);
  }
  int conv_transpose(int input, int channels, int kernel, int padding) {
    const int inputs = node(input).channels;
    se::ConvTranspose3dOp op{kernel, padding, weights_({inputs, channels, kernel, kernel, kernel}),
                             weights_({channels}, 0.1f)};
    return add(op, {input}, node(input).level - 1, channels);
  }
  int upsample(int input) {
    return add(se::UpsampleOp{}, {input}, node(input).level - 1, node(input).channels);
  }
  int concat(int a, int b) {
    return add(se::ConcatOp{}, {a, b}, node(a).level, node(a).channels + node(b).channels);
  }
  int leaky_relu(int input, float negative_slope = 0.01f) {
    return same(se::LeakyReluOp{negative_slope}, input);
  }
  int affine(int input) {
    const int channels = node(input).channels;
    return same(se::AffineOp{weights_({channels}, 1.0f), weights_({channels}, 1.0f)}, input);
  }
  int tanh(int input) { return same(se::TanhOp{}, input); }
  int sigmoid(int input) { return same(se::SigmoidOp{}, input); }
  int softmax(int input) { return same(se::SoftmaxOp{}, input); }

  se::LatticeModel model;

 private:
  const se::Node& node(int i) const { return model.nodes[static_cast<std::size_t>(i)]; }
  int same(se::Op op, int input) {
    return add(std::move(op), {input}, node(input).level, node(input).channels);
  }
  int add(se::Op op, std::vector<int> inputs, int level, int channels) {
    const std::string name = "node" + std::to_string(model.nodes.size());
    model.nodes.push_back({name, std::move(op), std::move(inputs), level, channels});
    return static_cast<int>(model.nodes.size()) - 1;
  }

  Weights weights_;
};

// Batch norm is folded. A leaky ReLU follows each convolution except the last.
inline se::LatticeModel gutierrez(int coarsest = 5, int noise_channels = 3, int step_channels = 4) {
  LatticeBuilder b(1);
  const auto block = [&](int input, int channels) {
    for (const int kernel : {3, 3, 1}) input = b.leaky_relu(b.conv(input, channels, kernel));
    return input;
  };
  int features = block(b.noise(coarsest, noise_channels), step_channels);
  for (int level = coarsest - 1; level >= 0; --level) {
    const int upsampled = b.upsample(features);
    const int fresh = block(b.noise(level, noise_channels), step_channels);
    features = block(b.concat(upsampled, fresh), step_channels * (coarsest - level + 1));
  }
  b.conv(features, 3, 1);
  return b.model;
}

// Every operation once or twice, odd channel counts, both distributions, and a skip connection.
inline se::LatticeModel every_operation() {
  LatticeBuilder b(2);
  const int coarse = b.tanh(b.conv(b.noise(2, 2, se::Distribution::normal), 5, 3));
  const int grown = b.conv_transpose(coarse, 3, 4, 1);
  const int skipped = b.leaky_relu(grown, 0.2f);
  const int waves = b.periodic(1, {{{0xFFFFFFF0u, 0x12345678u, 7}, 5}, {{}, 0x40000000u}});
  const int wide = b.affine(b.conv(b.concat(b.concat(skipped, b.noise(1, 1)), waves), 7, 5));
  const int joined = b.concat(wide, grown);
  const int fine = b.conv(b.concat(b.upsample(joined), b.conv_transpose(joined, 2, 3, 2)), 9, 3);
  b.softmax(b.conv(b.sigmoid(b.conv(b.leaky_relu(fine), 4, 1)), 4, 1));
  return b.model;
}

inline se::SamplerModel sampler(int octaves = 8, int layers = 5, int width = 24, int channels = 3) {
  Weights weights(3);
  se::SamplerModel model;
  model.octaves = octaves;
  model.width = width;
  model.negative_slope = 0.2f;
  model.transforms = weights({octaves, 3, 3}, 0.5f);
  model.constant = weights({width}, 1.0f);
  const int per_layer = octaves / (layers - 1);
  for (int l = 0; l < layers; ++l) {
    model.hidden.push_back({weights({width, width}), weights({width}, 0.1f), {}});
    if (l + 1 < layers) model.hidden.back().noise = weights({width, per_layer}, 0.5f);
  }
  model.output_weight = weights({channels, width});
  model.output_bias = weights({channels}, 0.1f);
  return model;
}

}  // namespace example
