// Reader of the sampler family.
#include "engine/model/readers.h"

namespace solidtex::engine {
namespace {

constexpr std::int64_t max_octaves = 256, max_hidden_layers = 64, max_width = 4096;

}  // namespace

SamplerModel read_sampler(const Fields& sampler, const Model& model, TensorSource& tensors) {
  if (model.noise_scheme != NoiseScheme::solidtex_1)
    throw invalid(sampler.label(), "noise.scheme", "\"solidtexturenets\"",
                  "\"solidtex-1\": the sampler needs normal noise");
  sampler.allow_only({"octaves", "hidden_layers", "width", "slope"});
  const std::int64_t layers = sampler.integer("hidden_layers", 2, max_hidden_layers);
  const std::int64_t octaves = sampler.integer("octaves", 1, max_octaves);
  const std::int64_t width = sampler.integer("width", 1, max_width);
  const std::int64_t channels = static_cast<std::int64_t>(model.channels.size());
  SamplerModel result;
  result.negative_slope = static_cast<float>(sampler.number("slope", 0, 1));
  if (octaves % (layers - 1) != 0)
    throw sampler.wrong("octaves",
                        "a multiple of " + std::to_string(layers - 1) + ", hidden_layers - 1");
  result.octaves = static_cast<int>(octaves);
  result.width = static_cast<int>(width);
  result.transforms = tensors.take("transforms", {octaves, 3, 3});
  result.constant = tensors.take("constant", {width});
  for (std::int64_t layer = 0; layer < layers; ++layer) {
    const std::string prefix = "hidden." + std::to_string(layer);
    auto& hidden = result.hidden.emplace_back();
    hidden.weight = tensors.take(prefix + ".weight", {width, width});
    hidden.bias = tensors.take(prefix + ".bias", {width});
    if (layer < layers - 1)
      hidden.noise = tensors.take(prefix + ".noise", {width, octaves / (layers - 1)});
  }
  result.output_weight = tensors.take("output.weight", {channels, width});
  result.output_bias = tensors.take("output.bias", {channels});
  return result;
}

}  // namespace solidtex::engine
