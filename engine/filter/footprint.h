// How large a footprint is, in octaves, and what fades out above.
#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "engine/common/output_view.h"

namespace solidtex::engine {

// Edges of 2^kCoarsest texels and more see nothing but the mean.
inline constexpr int kCoarsest = 9;

// A footprint's edge, twice its radius, lies between 2^level and 2^(level + 1) texels, at
// `fraction` between them; level -1 is an edge between none and one texel.
struct FootprintScale {
  int level = -1;
  float fraction = 0;

  // Linear between powers of two instead of logarithmic: no libm in the value path.
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

// Which channels are encoded as sRGB. Light adds up, encoded values do not: averages of them would
// be too dark, a rough checkerboard of black and white by a third. The encoding is nearly a square
// root, and squares need no libm: theirs are the averages that are taken.
class LightChannels {
 public:
  LightChannels(const std::vector<std::string>& channels, const std::string& color_space);

  std::size_t count() const { return encoded_.size(); }
  // From stored values to what can be averaged and back; below zero becomes zero, which does not
  // change with the position.
  void to_light(const OutputView& output, std::size_t points) const;
  void from_light(const OutputView& output, std::size_t points) const;

 private:
  std::vector<bool> encoded_;
};

// The mean of some points' channels, in their order; that of one has its bits.
void mean_of(const OutputView& parts, std::size_t points, std::size_t channels,
             const OutputView& mean);

// filtered = offset + gain * value, one of each per channel, for edges of one size.
struct FadeStep {
  std::vector<float> gain, offset;
};

// Of one point's channels: linear between steps[finer] and the one after it, if there is one.
void fade(const std::vector<FadeStep>& steps, std::size_t finer, float fraction,
          const OutputView& output);

// The line that predicts true averages from values best, in the sense of least squares: sums in
// double, in the order of the samples. values and truths are [sample][channel].
FadeStep fit_fade(const std::vector<float>& values, const std::vector<float>& truths,
                  std::size_t channels);

// What every footprint of the largest size sees.
FadeStep only_mean(const std::vector<float>& values, std::size_t channels);

// Leaves values as they are.
FadeStep no_fade(std::size_t channels);

}  // namespace solidtex::engine
