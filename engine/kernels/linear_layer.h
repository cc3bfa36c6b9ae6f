// Weights of a convolution or a dense layer, packed for the kernels.
#pragma once

#include <hwy/aligned_allocator.h>

#include <algorithm>
#include <cstddef>
#include <new>
#include <utility>
#include <vector>

namespace solidtex::engine {

// out[o] = phi(bias[o] + sum over t of weight(o, t) * in[t]): terms in ascending order, each a
// fused multiply-add. phi(v) = v > 0 ? v : negative_slope * v; a negative_slope of 1 is the
// identity. The terms of a convolution are (input channel, kx, ky, kz), kz fastest.
struct LinearLayer {
  static constexpr int kPack = 4;

  int outputs = 0, terms = 0;
  std::vector<float> packed;  // [ceil(outputs / kPack)][term][kPack], zeros behind the last output
  std::vector<float> bias;    // the same number of packs
  float negative_slope = 1;

  LinearLayer() = default;

  // Calls weight_of(o, t) once per weight.
  template <class WeightOf>
  LinearLayer(int output_count, int term_count, std::vector<float> biases, WeightOf weight_of)
      : outputs(output_count), terms(term_count), bias(std::move(biases)) {
    const int packs = (outputs + kPack - 1) / kPack;
    bias.resize(static_cast<std::size_t>(packs) * kPack);
    packed.resize(static_cast<std::size_t>(packs) * terms * kPack);
    for (int o = 0; o < outputs; ++o)
      for (int t = 0; t < terms; ++t) packed[index(o, t)] = weight_of(o, t);
  }

  std::size_t index(int o, int t) const {
    return (static_cast<std::size_t>(o / kPack) * terms + t) * kPack + o % kPack;
  }
  float weight(int o, int t) const { return packed[index(o, t)]; }
  float activate(float v) const { return v > 0 ? v : negative_slope * v; }
};

// The layer for one point: neighboring outputs are contiguous.
struct PointLayer {
  static constexpr std::ptrdiff_t kStep = 16;  // whole vectors on every target

  int terms = 0;
  std::ptrdiff_t pitch = 0;  // outputs, rounded up to kStep
  // [term][pitch], padded with zeros, aligned.
  hwy::AlignedFreeUniquePtr<float[]> weights;
  std::vector<float> bias;  // [pitch]
  float negative_slope = 1;

  explicit PointLayer(const LinearLayer& layer)
      : terms(layer.terms),
        pitch((layer.outputs + kStep - 1) / kStep * kStep),
        weights(hwy::AllocateAligned<float>(static_cast<std::size_t>(pitch * std::max(terms, 1)))),
        bias(static_cast<std::size_t>(pitch)),
        negative_slope(layer.negative_slope) {
    if (!weights) throw std::bad_alloc();
    std::fill_n(weights.get(), pitch * terms, 0.0f);
    for (int o = 0; o < layer.outputs; ++o) {
      bias[o] = layer.bias[o];
      for (int t = 0; t < terms; ++t) weights[t * pitch + o] = layer.weight(o, t);
    }
  }
};

}  // namespace solidtex::engine
