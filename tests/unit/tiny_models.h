// The smallest models that exercise a whole family.
#pragma once

#include <vector>

#include "engine/model/model.h"

namespace solidtex::engine {

inline Tensor tensor(std::vector<std::int64_t> shape, float first, float step) {
  Tensor result{std::move(shape), {}};
  std::size_t count = 1;
  for (const std::int64_t extent : result.shape) count *= static_cast<std::size_t>(extent);
  for (std::size_t i = 0; i < count; ++i) {
    result.values.push_back(first + step * static_cast<float>(i % 13) - step * 6);
  }
  return result;
}

// Noise on two levels, the coarse one upsampled and concatenated, then a 3^3 convolution to two
// channels.
inline Model tiny_lattice() {
  LatticeModel lattice;
  lattice.nodes.push_back({"coarse", NoiseOp{Distribution::uniform}, {}, 1, 1});
  lattice.nodes.push_back({"up", UpsampleOp{}, {0}, 0, 1});
  lattice.nodes.push_back({"fine", NoiseOp{Distribution::uniform}, {}, 0, 2});
  lattice.nodes.push_back({"joined", ConcatOp{}, {1, 2}, 0, 3});
  lattice.nodes.push_back(
      {"conv", Conv3dOp{3, tensor({2, 3, 3, 3, 3}, 0, 0.02f), tensor({2}, 0.5f, 0.1f)}, {3}, 0, 2});
  Model model;
  model.name = "tiny-lattice";
  model.channels = {"a", "b"};
  model.color_space = "data";
  model.architecture = std::move(lattice);
  return model;
}

inline Model tiny_sampler() {
  SamplerModel sampler;
  sampler.octaves = 2;
  sampler.width = 8;
  sampler.negative_slope = 0.2f;
  sampler.transforms = {{2, 3, 3},
                        {0.3f, 0, 0, 0, 0.3f, 0, 0, 0, 0.3f, 0.1f, 0, 0, 0, 0.1f, 0, 0, 0, 0.1f}};
  sampler.constant = tensor({8}, 0.1f, 0.1f);
  for (int layer = 0; layer < 3; ++layer) {
    SamplerModel::HiddenLayer hidden{tensor({8, 8}, 0, 0.05f), tensor({8}, 0, 0.1f), {}};
    if (layer < 2) hidden.noise = tensor({8, 1}, 0.2f, 0.1f);
    sampler.hidden.push_back(std::move(hidden));
  }
  sampler.output_weight = tensor({3, 8}, 0, 0.1f);
  sampler.output_bias = tensor({3}, 0.5f, 0.1f);
  Model model;
  model.name = "tiny-sampler";
  model.channels = {"a", "b", "c"};
  model.color_space = "data";
  model.architecture = std::move(sampler);
  return model;
}

}  // namespace solidtex::engine
