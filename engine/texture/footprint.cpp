#include "engine/texture/footprint.h"

#include <algorithm>
#include <cstddef>

namespace solidtex::engine {
namespace {

double mean_of(const std::vector<float>& values, std::size_t channels, std::size_t channel) {
  double sum = 0;
  for (std::size_t i = channel; i < values.size(); i += channels) sum += values[i];
  return sum / static_cast<double>(values.size() / channels);
}

}  // namespace

LightChannels::LightChannels(const std::vector<std::string>& channels,
                             const std::string& color_space) {
  for (const std::string& name : channels)
    encoded_.push_back(color_space == "srgb" && name.starts_with("albedo."));
}

void LightChannels::to_light(float* values, std::size_t points) const {
  for (std::size_t p = 0; p < points; ++p, values += count())
    for (std::size_t c = 0; c < count(); ++c)
      if (encoded_[c]) values[c] = values[c] > 0 ? values[c] * values[c] : 0;
}

void LightChannels::from_light(float* values, std::size_t points) const {
  for (std::size_t p = 0; p < points; ++p, values += count())
    for (std::size_t c = 0; c < count(); ++c)
      if (encoded_[c]) values[c] = values[c] > 0 ? std::sqrt(values[c]) : 0;
}

void mean_of(const float* values, std::size_t points, std::size_t channels, float* mean) {
  std::copy_n(values, channels, mean);
  for (std::size_t i = channels; i < points * channels; ++i) mean[i % channels] += values[i];
  for (std::size_t c = 0; c < channels; ++c) mean[c] /= static_cast<float>(points);
}

void fade(const std::vector<FadeStep>& steps, std::size_t finer, float fraction, float* values) {
  const auto last = steps.size() - 1;
  const FadeStep &fine = steps[std::min(finer, last)], &coarse = steps[std::min(finer + 1, last)];
  const auto between = [fraction](float a, float b) { return std::fma(fraction, b - a, a); };
  for (std::size_t c = 0; c < fine.gain.size(); ++c) {
    values[c] = std::fma(between(fine.gain[c], coarse.gain[c]), values[c],
                         between(fine.offset[c], coarse.offset[c]));
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
    // A gain above one would sharpen; below zero is chance.
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
