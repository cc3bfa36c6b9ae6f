// Size of a footprint, averages in linear light, and fading of values towards the mean.
#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "engine/common/output_view.h"

namespace solidtex::engine {

// Footprints with edges of 2^kCoarsest texels and more give the mean of the material.
inline constexpr int kCoarsest = 9;

// Scale of a footprint: its edge lies between 2^level and 2^(level + 1) texels, at `fraction`.
// Level -1 is an edge between 0 and 1 texel.
struct FootprintScale {
  int level = -1;
  float fraction = 0;

  // Linear between powers of two, not logarithmic: no libm in the value path.
  explicit FootprintScale(float radius) {
    const float edge = 2 * radius;
    if (edge >= static_cast<float>(1 << kCoarsest)) {
      level = kCoarsest;
    } else if (edge >= 1) {
      int exponent = 0;
      fraction = 2 * std::frexp(edge, &exponent) - 1;
      level = exponent - 1;
    } else {
      fraction = edge;
    }
  }
};

// Channels that are encoded as sRGB. Averages are taken in linear light; the encoding is
// approximated by a square root, so that no libm is in the value path.
class LightChannels {
 public:
  LightChannels(const std::vector<std::string>& channels, const std::string& color_space);

  std::size_t count() const { return encoded_.size(); }
  // Converts stored values to linear light and back. Negative values become 0, with a derivative of
  // 0.
  void to_light(const OutputView& output, std::size_t points) const;
  void from_light(const OutputView& output, std::size_t points) const;

 private:
  std::vector<bool> encoded_;
};

// Averages the channels of some points in their order. One point keeps its bits.
void mean_of(const OutputView& parts, std::size_t points, std::size_t channels,
             const OutputView& mean);

// filtered = offset + gain * value, per channel, for footprints of one size.
struct FadeStep {
  std::vector<float> gain, offset;
};

// Fades the channels of one point, interpolated between steps[finer] and the next step.
void fade(const std::vector<FadeStep>& steps, std::size_t finer, float fraction,
          const OutputView& output);

// Fits the line that predicts true means from values with the least squared error. Sums are in
// double, in the order of the samples. values and truths are [sample][channel].
FadeStep fit_fade(const std::vector<float>& values, const std::vector<float>& truths,
                  std::size_t channels);

// Returns a step that gives the mean.
FadeStep only_mean(const std::vector<float>& values, std::size_t channels);

// Returns a step that keeps values.
FadeStep no_fade(std::size_t channels);

}  // namespace solidtex::engine
