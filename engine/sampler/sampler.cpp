#include "engine/sampler/sampler.h"

#include <algorithm>
#include <array>

#include "engine/kernels/kernels.h"
#include "engine/noise/noise.h"
#include "engine/noise/solidtex_1.h"
#include "engine/sampler/part_buffers.h"

namespace solidtex::engine {

namespace {

// Up to this many points are evaluated one by one: a block costs as much as four points.
constexpr std::size_t kFewPoints = 4;

// Returns the number of points at the end of a batch that are evaluated one by one.
std::size_t alone(std::size_t count) {
  const std::size_t rest = count % kOctaveBlock;
  return rest <= kFewPoints ? rest : 0;
}

// Returns the layer for derivatives of its inputs, without the activation.
LinearLayer without_bias(const LinearLayer& layer) {
  LinearLayer result = layer;
  std::ranges::fill(result.bias, 0.0f);
  result.negative_slope = 1;
  return result;
}

// Converts [channel][pitch] to [point][channel]. Returns the end of the output.
float* interleave(const float* planar, int pitch, int count, int channels, float* values) {
  for (int p = 0; p < count; ++p)
    for (int c = 0; c < channels; ++c) *values++ = planar[c * pitch + p];
  return values;
}

// Working memory of one point, on the stack for networks of usual size.
class PointBuffer {
 public:
  explicit PointBuffer(std::size_t size) {
    if (size > kOnStack) heap_.resize(size);
    data_ = size > kOnStack ? heap_.data() : stack_;
  }
  PointBuffer(const PointBuffer&) = delete;
  PointBuffer& operator=(const PointBuffer&) = delete;
  float* data() { return data_; }

 private:
  static constexpr std::size_t kOnStack = 2048;
  alignas(64) float stack_[kOnStack];
  std::vector<float> heap_;
  float* data_;
};

// Layer 0 has the same input everywhere: its bias becomes bias + W c, summed in double in ascending
// order.
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

// Packs the columns of [weight | noise]. Uses `inputs` columns of weight, none for layer 0.
LinearLayer pack(const Tensor& weight, const Tensor& noise, std::vector<float> bias, int inputs,
                 int octaves, float negative_slope) {
  const auto outputs = static_cast<int>(bias.size());
  LinearLayer layer(outputs, inputs + octaves, std::move(bias), [&](int o, int t) {
    return t < inputs ? weight.values[static_cast<std::size_t>(o) * inputs + t]
                      : noise.values[static_cast<std::size_t>(o) * octaves + (t - inputs)];
  });
  layer.negative_slope = negative_slope;
  return layer;
}

}  // namespace

Sampler::Sampler(const SamplerModel& model, NoiseScheme scheme, std::uint64_t seed,
                 Precision precision)
    : width_(model.width),
      octaves_per_layer_(model.octaves / static_cast<int>(model.hidden.size() - 1)),
      octaves_(model.transforms, seed),
      fade_(octaves_) {
  require_normal(scheme);
  const auto& hidden = model.hidden;
  for (std::size_t l = 0; l < hidden.size(); ++l)
    layers_.push_back(pack(hidden[l].weight, hidden[l].noise,
                           l == 0 ? folded_bias(model) : hidden[l].bias.values, l == 0 ? 0 : width_,
                           l + 1 < hidden.size() ? octaves_per_layer_ : 0, model.negative_slope));
  layers_.push_back(
      pack(model.output_weight, {}, model.output_bias.values, width_, 0, /*negative_slope=*/1));
  for (const LinearLayer& layer : layers_) {
    point_layers_.emplace_back(layer);
    derivative_layers_.push_back(without_bias(layer));
    point_derivative_layers_.emplace_back(derivative_layers_.back());
  }
  if (precision == Precision::fast && MatrixNetwork::supported())
    fast_.emplace(std::span(layers_).first(hidden.size()));
}

// Rows of an activation buffer, including the padding that kernels write.
std::size_t Sampler::activation_rows() const {
  return static_cast<std::size_t>(std::max(width_, channels()) + PointLayer::kStep +
                                  octaves_per_layer_);
}

void Sampler::evaluate(const double* positions, std::size_t count, float* values) const {
  if (fast_) return evaluate_fast(positions, count, values);
  const std::size_t in_blocks = count - alone(count);
  evaluate_parts(positions, nullptr, in_blocks, kOctaveBlock, values, nullptr);
  for (std::size_t point = in_blocks; point < count; ++point)
    evaluate_point(positions + 3 * point, values + point * channels());
}

void Sampler::evaluate_faded(const double* positions, const Spread* footprints, std::size_t count,
                             float* values, float* jacobians) const {
  const std::size_t in_blocks = count - alone(count), first = in_blocks * channels();
  evaluate_parts(positions, footprints, in_blocks, kOctaveBlock, values, jacobians);
  evaluate_parts(positions + 3 * in_blocks, footprints ? footprints + in_blocks : nullptr,
                 count - in_blocks, 1, values + first, jacobians ? jacobians + 3 * first : nullptr);
}

void Sampler::evaluate_parts(const double* positions, const Spread* footprints, std::size_t count,
                             std::size_t part, float* values, float* jacobians) const {
  if (count == 0) return;
  PartBuffers buffers(activation_rows(), std::min(count, part), jacobians != nullptr);
  for (std::size_t done = 0; done < count; done += part) {
    const std::size_t first = done * channels();
    evaluate_part(positions + 3 * done, footprints ? footprints + done : nullptr,
                  static_cast<int>(std::min(count - done, part)), buffers, values + first,
                  jacobians ? jacobians + 3 * first : nullptr);
  }
}

void Sampler::evaluate_part(const double* positions, const Spread* footprints, int count,
                            PartBuffers& buffers, float* values, float* jacobians) const {
  buffers.lookup.positions.assign(positions, count);
  if (footprints) buffers.footprints.assign(footprints, count);
  for (std::size_t l = 0; l < layers_.size(); ++l) {
    const int inputs = l == 0 ? 0 : width_;
    for (int t = inputs; t < layers_[l].terms; ++t) {
      const int octave = static_cast<int>(l) * octaves_per_layer_ + (t - inputs);
      float* noise = buffers.values_of(t);
      const std::array<float*, 3> derivatives = buffers.derivatives_of(t);
      if (jacobians) {
        octave_derivatives(octave, count, buffers.lookup, noise, derivatives.data());
      } else {
        octave_noise(octave, count, buffers.lookup, noise);
      }
      if (!footprints) continue;
      const FadeDivisors divisors = fade_.divisors(octave, buffers.footprints);
      divisors.apply(count, noise);
      if (jacobians)
        std::ranges::for_each(derivatives, [&](float* s) { divisors.apply(count, s); });
    }
    if (buffers.is_point) {
      point_layer(l, buffers);
    } else {
      block_layer(l, count, buffers);
    }
  }
  interleave(buffers.current, static_cast<int>(buffers.pitch), count, channels(), values);
  if (jacobians)
    for (int p = 0; p < count; ++p)
      for (int c = 0; c < channels(); ++c)
        for (const float* derivative : buffers.derivatives_of(c)) *jacobians++ = derivative[p];
}

void Sampler::block_layer(std::size_t l, int count, PartBuffers& buffers) const {
  const LinearLayer& layer = layers_[l];
  kernels::dense(layer, buffers.current, count, kOctaveBlock, buffers.next);
  std::swap(buffers.current, buffers.next);
  if (!buffers.with_derivatives) return;
  const auto columns = static_cast<int>(buffers.row_pitch);
  kernels::dense(derivative_layers_[l], buffers.derivatives, columns, columns,
                 buffers.next_derivatives);
  std::swap(buffers.derivatives, buffers.next_derivatives);
  kernels::activate_derivatives(layer, buffers.current, kOctaveBlock,
                                static_cast<std::ptrdiff_t>(buffers.axis_pitch),
                                buffers.derivatives);
}

void Sampler::point_layer(std::size_t l, PartBuffers& buffers) const {
  kernels::dense_point(point_layers_[l], buffers.current, buffers.next);
  std::swap(buffers.current, buffers.next);
  if (!buffers.with_derivatives) return;
  for (std::size_t at = 0; at < 3 * buffers.axis_pitch; at += buffers.axis_pitch) {
    kernels::dense_point(point_derivative_layers_[l], buffers.derivatives + at,
                         buffers.next_derivatives + at);
    for (int o = 0; o < layers_[l].outputs; ++o)
      buffers.next_derivatives[at + o] *= buffers.current[o] > 0 ? 1 : layers_[l].negative_slope;
  }
  std::swap(buffers.derivatives, buffers.next_derivatives);
}

void Sampler::octave_noise(int octave, int count, Lookup& lookup, float* values) const {
  find_octave_cells(octaves_.transform_of(octave).data(), lookup.positions, count, lookup.cells);
  solidtex_1::trilinear_normal(octaves_.key_of(octave), lookup.cells.view(), count, values);
}

void Sampler::octave_derivatives(int octave, int count, Lookup& lookup, float* values,
                                 float* const* derivatives) const {
  const std::array<double, 9> transform = octaves_.transform_of(octave);
  float entries[9];  // as stored in the file
  std::ranges::transform(transform, entries, [](double e) { return static_cast<float>(e); });
  find_octave_cells(transform.data(), lookup.positions, count, lookup.cells);
  solidtex_1::trilinear_normal_derivatives(octaves_.key_of(octave), lookup.cells.view(), entries,
                                           count, values, derivatives);
}

void Sampler::evaluate_fast(const double* positions, std::size_t count, float* values) const {
  constexpr std::size_t kBlock = MatrixNetwork::kBlock;
  MatrixNetwork::Block block(*fast_, static_cast<int>(std::min(count, kBlock)));
  std::vector<float> outputs(static_cast<std::size_t>(channels() + LinearLayer::kPack) *
                             static_cast<std::size_t>(block.pitch()));
  for (std::size_t done = 0; done < count; done += kBlock) {
    const auto points = static_cast<int>(std::min(count - done, kBlock));
    block_noise(positions + 3 * done, points, block);
    fast_->evaluate(points, block);
    kernels::dense(layers_.back(), block.units(), points, block.pitch(), outputs.data());
    values = interleave(outputs.data(), block.pitch(), points, channels(), values);
  }
}

void Sampler::block_noise(const double* positions, int count, MatrixNetwork::Block& block) const {
  if (count <= static_cast<int>(kFewPoints)) {
    std::vector<float> values(octaves_.padded());
    for (int p = 0; p < count; ++p) {
      point_noise(positions + 3 * p, values.data());
      for (int o = 0; o < octaves_.count; ++o) block.octave(o)[p] = values[o];
    }
    return;
  }
  Lookup lookup;
  for (int first = 0; first < count; first += kOctaveBlock) {
    const int part = std::min(count - first, kOctaveBlock);
    lookup.positions.assign(positions + 3 * first, part);
    for (int o = 0; o < octaves_.count; ++o) octave_noise(o, part, lookup, block.octave(o) + first);
  }
}

void Sampler::evaluate_point(const double* position, float* values) const {
  const std::size_t rows = activation_rows(), octaves = octaves_.padded();
  PointBuffer buffer(2 * rows + octaves);
  float *current = buffer.data(), *next = current + rows, *noise = next + rows;
  point_noise(position, noise);
  for (std::size_t l = 0; l < point_layers_.size(); ++l) {
    const PointLayer& layer = point_layers_[l];
    const int inputs = l == 0 ? 0 : width_;
    std::copy_n(noise, layer.terms - inputs, current + inputs);
    noise += layer.terms - inputs;
    kernels::dense_point(layer, current, next);
    std::swap(current, next);
  }
  std::copy_n(current, channels(), values);
}

// Evaluates every octave at one position.
void Sampler::point_noise(const double* position, float* values) const {
  OctaveCells cells;
  for (int first = 0; first < octaves_.count; first += kOctaveBlock) {
    const int count = std::min(octaves_.count - first, kOctaveBlock);
    find_point_cells(octaves_, first, count, position, cells);
    solidtex_1::trilinear_normal_of_streams(octaves_.keys(first), cells.view(), count,
                                            values + first);
  }
}

}  // namespace solidtex::engine
