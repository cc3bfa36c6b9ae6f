#include "engine/sampler/sampler.h"

#include <hwy/aligned_allocator.h>

#include <algorithm>
#include <new>

#include "engine/kernels/kernels.h"
#include "engine/sampler/octave.h"

namespace solidtex::engine {

namespace {

// Layer 0 sees the same input everywhere: bias + W c, summed in double, in ascending order.
std::vector<float> folded_bias(const SamplerModel& model) {
  const SamplerModel::HiddenLayer& layer = model.hidden[0];
  std::vector<float> bias(model.width);
  for (int o = 0; o < model.width; ++o) {
    double sum = layer.bias.values[o];
    for (int i = 0; i < model.width; ++i)
      sum += double{layer.weight.values[static_cast<std::size_t>(o) * model.width + i]} *
             double{model.constant.values[i]};
    bias[o] = static_cast<float>(sum);
  }
  return bias;
}

// The columns of [weight | noise]; `inputs` of weight's columns are used (none for layer 0).
LinearLayer pack(const Tensor& weight, const Tensor& noise, std::vector<float> bias, int inputs,
                 int octaves, float slope) {
  const auto outputs = static_cast<int>(bias.size());
  LinearLayer layer(outputs, inputs + octaves, std::move(bias), [&](int o, int t) {
    return t < inputs ? weight.values[static_cast<std::size_t>(o) * inputs + t]
                      : noise.values[static_cast<std::size_t>(o) * octaves + (t - inputs)];
  });
  layer.slope = slope;
  return layer;
}

}  // namespace

// Everything a block of points needs, planar. An activation buffer has the rows of a layer's input:
// the previous layer's units, then its octaves.
struct Sampler::Buffers {
  Buffers(int width, int octaves)
      : storage(hwy::AllocateAligned<float>(
            2 * static_cast<std::size_t>(width + octaves) * kOctaveBlock + kReadSlack)) {
    if (!storage) throw std::bad_alloc();
    current = storage.get();
    next = current + static_cast<std::ptrdiff_t>(width + octaves) * kOctaveBlock;
  }
  hwy::AlignedFreeUniquePtr<float[]> storage;
  float *current, *next;
  PlanarPositions positions;
  OctaveCells cells;
};

Sampler::Sampler(const SamplerModel& model, NoiseScheme scheme, std::uint64_t seed,
                 [[maybe_unused]] Precision precision)
    : width_(model.width),
      octaves_per_layer_(model.octaves / static_cast<int>(model.hidden.size() - 1)) {
  require_normal(scheme);
  for (int i = 0; i < model.octaves; ++i) {
    octaves_.push_back({{}, NoiseStream(scheme, seed, static_cast<std::uint32_t>(i), 0)});
    std::copy_n(&model.transforms.values[static_cast<std::size_t>(i) * 9], 9,
                octaves_.back().transform);
  }
  const auto& hidden = model.hidden;
  for (std::size_t l = 0; l < hidden.size(); ++l)
    layers_.push_back(pack(hidden[l].weight, hidden[l].noise,
                           l == 0 ? folded_bias(model) : hidden[l].bias.values, l == 0 ? 0 : width_,
                           l + 1 < hidden.size() ? octaves_per_layer_ : 0, model.slope));
  layers_.push_back(
      pack(model.output_weight, {}, model.output_bias.values, width_, 0, /*slope=*/1));
}

void Sampler::evaluate(const double* positions, std::size_t count, float* values) const {
  Buffers buffers(std::max(width_, channels()), octaves_per_layer_);
  for (std::size_t done = 0; done < count; done += kOctaveBlock) {
    const auto block = static_cast<int>(std::min<std::size_t>(count - done, kOctaveBlock));
    evaluate_block(positions + 3 * done, block, buffers, values + done * channels());
  }
}

void Sampler::evaluate_block(const double* positions, int count, Buffers& buffers,
                             float* values) const {
  for (int p = 0; p < count; ++p)
    for (int axis = 0; axis < 3; ++axis) buffers.positions.axis[axis][p] = positions[3 * p + axis];

  for (std::size_t l = 0; l < layers_.size(); ++l) {
    const LinearLayer& layer = layers_[l];
    const int inputs = l == 0 ? 0 : width_;
    for (int t = inputs; t < layer.terms; ++t)
      octave_noise(l * octaves_per_layer_ + (t - inputs), count, buffers,
                   buffers.current + t * kOctaveBlock);
    kernels::dense(layer, buffers.current, count, kOctaveBlock, buffers.next);
    std::swap(buffers.current, buffers.next);
  }
  for (int p = 0; p < count; ++p)
    for (int c = 0; c < channels(); ++c) *values++ = buffers.current[c * kOctaveBlock + p];
}

void Sampler::octave_noise(std::size_t octave, int count, Buffers& buffers, float* values) const {
  const OctaveCells& cells = buffers.cells;
  find_octave_cells(octaves_[octave].transform, buffers.positions, count, buffers.cells);
  octaves_[octave].noise.trilinear_normal(
      {{cells.corner[0], cells.corner[1], cells.corner[2]},
       {cells.fraction[0], cells.fraction[1], cells.fraction[2]}},
      count, values);
}

}  // namespace solidtex::engine
