#include <algorithm>
#include <utility>

#include "engine/kernels/winograd.h"

namespace solidtex::engine {

namespace {

int padded_to_pack(int count) {
  return (count + ChannelLayer::kPack - 1) / ChannelLayer::kPack * ChannelLayer::kPack;
}

// G g of F(2, 3) along one axis of [outer][3][inner], to [outer][4][inner].
std::vector<double> transform_axis(const std::vector<double>& g, std::size_t inner) {
  const std::size_t outer = g.size() / (3 * inner);
  std::vector<double> result(outer * 4 * inner);
  for (std::size_t o = 0; o < outer; ++o)
    for (std::size_t i = 0; i < inner; ++i) {
      const double* from = &g[o * 3 * inner + i];
      double* to = &result[o * 4 * inner + i];
      to[0] = from[0];
      to[inner] = ((from[0] + from[inner]) + from[2 * inner]) / 2;
      to[2 * inner] = ((from[0] - from[inner]) + from[2 * inner]) / 2;
      to[3 * inner] = from[2 * inner];
    }
  return result;
}

}  // namespace

ChannelLayer::ChannelLayer(int input_count, int output_count, const std::vector<float>& from,
                           std::vector<float> biases)
    : inputs(input_count),
      outputs(output_count),
      padded(padded_to_pack(output_count)),
      weights(static_cast<std::size_t>(inputs) * padded),
      bias(std::move(biases)) {
  bias.resize(padded);
  for (int o = 0; o < outputs; ++o)
    for (int i = 0; i < inputs; ++i)
      weights[static_cast<std::size_t>(i) * padded + o] =
          from[static_cast<std::size_t>(o) * inputs + i];
}

WinogradLayer::WinogradLayer(int input_count, int output_count, const std::vector<float>& from,
                             std::vector<float> biases)
    : inputs(input_count),
      outputs(output_count),
      weights(static_cast<std::size_t>(kWinogradPositions) * inputs * outputs),
      bias(std::move(biases)) {
  for (int o = 0; o < outputs; ++o)
    for (int i = 0; i < inputs; ++i) {
      const auto first = from.begin() + (static_cast<std::ptrdiff_t>(o) * inputs + i) * 27;
      std::vector<double> g(first, first + 27);
      for (const std::size_t inner : {9, 3, 1}) g = transform_axis(g, inner);
      for (std::size_t p = 0; p < g.size(); ++p)
        weights[(((p / 4) * inputs + i) * outputs + o) * 4 + p % 4] = static_cast<float>(g[p]);
    }
}

int widest_layer(const ConvChain& chain) {
  int width = chain.first.outputs;
  for (const ChannelLayer& layer : chain.rest) width = std::max(width, layer.padded);
  return width;
}

}  // namespace solidtex::engine
