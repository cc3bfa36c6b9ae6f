#include <algorithm>
#include <array>
#include <cstdint>
#include <random>

#include "engine/common/parallel.h"
#include "engine/filter/axes.h"
#include "engine/filter/sampler_filter.h"

namespace solidtex::engine {
namespace {

constexpr std::size_t kCubes = 240, kPointsInCube = 96;  // multiples of a block of points
constexpr double kDistance = 4099;  // in texels; a multiple of no lattice's cells

// The sequence of std::mt19937 is standard; the results of distributions are not.
double uniform(std::mt19937& random) { return static_cast<double>(random()) * 0x1p-32; }

std::array<double, 3> middle_of(std::size_t cube) {
  return {kDistance * static_cast<double>(cube) + 0.5, 0.5, 0.5};
}

// Returns the mean over each cube, [cube][channel].
std::vector<float> means(const Sampler& sampler, const LightChannels& light, float edge) {
  const auto channels = static_cast<std::size_t>(sampler.channels());
  std::vector<float> result(kCubes * channels);
  for_each_part(kCubes, 4, [&](std::size_t begin, std::size_t end) {
    std::vector<double> positions(3 * kPointsInCube);
    std::vector<float> values(kPointsInCube * channels);
    for (std::size_t cube = begin; cube < end; ++cube) {
      std::mt19937 random(static_cast<std::uint32_t>(cube));
      const std::array<double, 3> middle = middle_of(cube);
      for (std::size_t i = 0; i < positions.size(); ++i)
        positions[i] = middle[i % 3] + edge * (uniform(random) - 0.5);
      sampler.evaluate(positions.data(), kPointsInCube, values.data());
      light.to_light(values.data(), kPointsInCube);
      std::ranges::copy(only_mean(values, channels).offset, &result[cube * channels]);
    }
  });
  return result;
}

// Returns the values at the centers of the cubes with faded octaves.
std::vector<float> faded_values(const Sampler& sampler, const LightChannels& light, float edge) {
  std::vector<double> positions;
  for (std::size_t cube = 0; cube < kCubes; ++cube)
    for (const double coordinate : middle_of(cube)) positions.push_back(coordinate);
  const std::vector<Spread> footprints(kCubes, Spread::of(Axes::cube(edge / 2).axis));
  std::vector<float> values(kCubes * static_cast<std::size_t>(sampler.channels()));
  sampler.evaluate_faded(positions.data(), footprints.data(), kCubes, values.data());
  light.to_light(values.data(), kCubes);
  return values;
}

constexpr std::size_t kRadiiPerOctave = 8;

// Returns radius i of a table: evenly spaced from 0, then from each power of two to the next, up to
// the largest edge.
float radius_at(std::size_t i) {
  if (i <= kRadiiPerOctave) return 0.5f * static_cast<float>(i) / kRadiiPerOctave;
  const std::size_t octave = (i - 1) / kRadiiPerOctave, step = (i - 1) % kRadiiPerOctave + 1;
  const auto first = static_cast<float>(1 << octave) / 4;
  return first + first * static_cast<float>(step) / kRadiiPerOctave;
}

}  // namespace

std::vector<FadeStep> fade_steps_of(const Sampler& sampler, const LightChannels& light) {
  const auto channels = static_cast<std::size_t>(sampler.channels());
  std::vector<FadeStep> steps = {no_fade(channels)};
  for (int level = 0; level <= kCoarsest; ++level) {
    const auto edge = static_cast<float>(1 << level);
    const std::vector<float> truths = means(sampler, light, edge);
    steps.push_back(level < kCoarsest
                        ? fit_fade(faded_values(sampler, light, edge), truths, channels)
                        : only_mean(truths, channels));
  }
  return steps;
}

EqualCube::EqualCube(const Sampler& sampler) {
  for (std::size_t i = 0; i <= (kCoarsest + 1) * kRadiiPerOctave; ++i)
    kept_.push_back(sampler.kept(Spread::of(Axes::cube(radius_at(i)).axis)));
}

float EqualCube::radius(float kept) const {
  const auto after = std::ranges::upper_bound(kept_, kept, std::ranges::greater());
  if (after == kept_.begin()) return 0;
  const auto i = static_cast<std::size_t>(after - kept_.begin());
  if (after == kept_.end()) return radius_at(i - 1);
  const float fraction = (kept_[i - 1] - kept) / (kept_[i - 1] - kept_[i]);
  return radius_at(i - 1) + fraction * (radius_at(i) - radius_at(i - 1));
}

}  // namespace solidtex::engine
