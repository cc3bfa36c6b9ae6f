#include <algorithm>
#include <array>
#include <utility>

#include "engine/kernels/winograd.h"

namespace solidtex::engine {

namespace {

int padded_to_pack(int count) {
  return (count + ChannelLayer::kPack - 1) / ChannelLayer::kPack * ChannelLayer::kPack;
}

// Rows of G: the weight transform of F(tile, 3) on one axis.
using Rows = std::vector<std::array<double, 3>>;

// Weight transform of upsampled inputs. See WinogradLayer.
Rows upsampled_transform() {
  return {
      {1. / 2, 1. / 2, -1. / 2}, {1. / 2, 1. / 2, 1. / 2}, {0, 0, 0}, {-1. / 2, 1. / 2, 1. / 2}};
}

Rows weight_transform(int tile) {
  if (tile == 2) return {{1, 0, 0}, {1. / 2, 1. / 2, 1. / 2}, {1. / 2, -1. / 2, 1. / 2}, {0, 0, 1}};
  return {{1. / 4, 0, 0},
          {-1. / 6, -1. / 6, -1. / 6},
          {-1. / 6, 1. / 6, -1. / 6},
          {1. / 24, 1. / 12, 1. / 6},
          {1. / 24, -1. / 12, 1. / 6},
          {0, 0, 1}};
}

// Transforms [outer][3][inner] to [outer][rows][inner].
std::vector<double> transform_axis(const std::vector<double>& g, const Rows& rows,
                                   std::size_t inner) {
  std::vector<double> result;
  for (std::size_t o = 0; o < g.size(); o += 3 * inner)
    for (const auto& row : rows)
      for (std::size_t i = 0; i < inner; ++i)
        result.push_back((row[0] * g[o + i] + row[1] * g[o + inner + i]) +
                         row[2] * g[o + 2 * inner + i]);
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

WinogradLayer::WinogradLayer(int tile_size, std::vector<bool> upsampled_inputs, int output_count,
                             const std::vector<float>& from, std::vector<float> biases)
    : tile(tile_size),
      outputs(output_count),
      upsampled(std::move(upsampled_inputs)),
      weights(16 * (tile + 2) * upsampled.size() * outputs),
      bias(std::move(biases)) {
  for (int o = 0; o < outputs; ++o)
    for (int i = 0; i < inputs(); ++i) {
      const Rows along_x = upsampled[i] ? upsampled_transform() : weight_transform(tile);
      const Rows across = upsampled[i] ? upsampled_transform() : weight_transform(2);
      const auto first = from.begin() + (static_cast<std::ptrdiff_t>(o) * inputs() + i) * 27;
      std::vector<double> g(first, first + 27);
      g = transform_axis(transform_axis(transform_axis(g, along_x, 9), across, 3), across, 1);
      for (std::size_t p = 0; p < g.size(); ++p)
        weights[(((p / 4) * inputs() + i) * outputs + o) * 4 + p % 4] = static_cast<float>(g[p]);
    }
}

int ConvChain::outputs() const {
  if (!rest.empty()) return rest.back().outputs;
  return is_direct() ? taps.outputs : first.outputs;
}

int widest_layer(const ConvChain& chain) {
  int width = std::max(chain.first.outputs, padded_to_pack(chain.taps.outputs));
  for (const ChannelLayer& layer : chain.rest) width = std::max(width, layer.padded);
  return width;
}

}  // namespace solidtex::engine
