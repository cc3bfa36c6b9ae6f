#include "engine/filter/footprint.h"

#include <algorithm>
#include <cstddef>

namespace solidtex::engine {
namespace {

double mean_of(const std::vector<float>& values, std::size_t channels, std::size_t channel) {
  double sum = 0;
  for (std::size_t i = channel; i < values.size(); i += channels) sum += values[i];
  const std::size_t count = values.size() / channels;
  return sum / static_cast<double>(count);
}

void scale(float* gradient, float factor) {
  for (int axis = 0; axis < 3; ++axis) gradient[axis] *= factor;
}

}  // namespace

LightChannels::LightChannels(const std::vector<std::string>& channels,
                             const std::string& color_space) {
  for (const std::string& name : channels)
    encoded_.push_back(color_space == "srgb" && name.starts_with("albedo."));
}

void LightChannels::to_light(const OutputView& output, std::size_t points) const {
  for (std::size_t i = 0; i < points * count(); ++i) {
    if (!encoded_[i % count()]) continue;
    float& value = output.values[i];
    const float root = value > 0 ? value : 0;
    value = root * root;
    if (output.jacobians) scale(&output.jacobians[3 * i], 2 * root);
  }
}

void LightChannels::from_light(const OutputView& output, std::size_t points) const {
  for (std::size_t i = 0; i < points * count(); ++i) {
    if (!encoded_[i % count()]) continue;
    float& value = output.values[i];
    value = value > 0 ? std::sqrt(value) : 0;
    if (output.jacobians) scale(&output.jacobians[3 * i], value > 0 ? 0.5f / value : 0);
  }
}

void mean_of(const OutputView& parts, std::size_t points, std::size_t channels,
             const OutputView& mean) {
  parts.for_both([&](auto member, std::size_t width) {
    const float* from = parts.*member;
    float* to = mean.*member;
    const std::size_t step = width * channels;
    std::copy_n(from, step, to);
    for (std::size_t p = 1; p < points; ++p)
      for (std::size_t i = 0; i < step; ++i) to[i] += from[p * step + i];
    for (std::size_t i = 0; i < step; ++i) to[i] /= static_cast<float>(points);
  });
}

void fade(const std::vector<FadeStep>& steps, std::size_t finer, float fraction,
          const OutputView& output) {
  const auto last = steps.size() - 1;
  const FadeStep &fine = steps[std::min(finer, last)], &coarse = steps[std::min(finer + 1, last)];
  const auto between = [fraction](float a, float b) { return std::fma(fraction, b - a, a); };
  for (std::size_t c = 0; c < fine.gain.size(); ++c) {
    const float gain = between(fine.gain[c], coarse.gain[c]);
    float& value = output.values[c];
    value = std::fma(gain, value, between(fine.offset[c], coarse.offset[c]));
    if (output.jacobians) scale(&output.jacobians[3 * c], gain);
  }
}

FadeStep fit_fade(const std::vector<float>& values, const std::vector<float>& truths,
                  std::size_t channels) {
  FadeStep step = only_mean(truths, channels);
  for (std::size_t c = 0; c < channels; ++c) {
    const double value_mean = mean_of(values, channels, c);
    const double truth_mean = mean_of(truths, channels, c);
    double covariance = 0, variance = 0;
    for (std::size_t i = c; i < values.size(); i += channels) {
      const double value = values[i] - value_mean;
      covariance += value * (truths[i] - truth_mean);
      variance += value * value;
    }
    // A gain above 1 would sharpen. A gain below 0 is noise.
    const double gain = variance > 0 ? std::fmin(std::fmax(covariance / variance, 0.0), 1.0) : 0.0;
    step.gain[c] = static_cast<float>(gain);
    step.offset[c] = static_cast<float>(truth_mean - gain * value_mean);
  }
  return step;
}

FadeStep only_mean(const std::vector<float>& values, std::size_t channels) {
  FadeStep step{std::vector<float>(channels, 0.0f), {}};
  for (std::size_t c = 0; c < channels; ++c)
    step.offset.push_back(static_cast<float>(mean_of(values, channels, c)));
  return step;
}

FadeStep no_fade(std::size_t channels) {
  return {std::vector<float>(channels, 1.0f), std::vector<float>(channels, 0.0f)};
}

}  // namespace solidtex::engine
