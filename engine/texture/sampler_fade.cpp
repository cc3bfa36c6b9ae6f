#include "engine/texture/sampler_fade.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>

#include "engine/texture/parallel.h"

namespace solidtex::engine {
namespace {

constexpr std::size_t kCubes = 240, kPointsInCube = 96;  // multiples of a block of points
constexpr double kDistance = 4099;                       // texels: no lattice's cells divide it

// Every sequence of std::mt19937 is prescribed, but not what distributions make of it.
double uniform(std::mt19937& random) { return random() * 0x1p-32; }

std::array<double, 3> middle_of(std::size_t cube) {
  return {kDistance * static_cast<double>(cube) + 0.5, 0.5, 0.5};
}

// The mean over each cube, [cube][channel].
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

// With faded octaves, in the middle of each cube.
std::vector<float> faded_values(const Sampler& sampler, const LightChannels& light, float edge) {
  std::vector<double> positions;
  for (std::size_t cube = 0; cube < kCubes; ++cube)
    for (const double coordinate : middle_of(cube)) positions.push_back(coordinate);
  const std::vector<float> edges(kCubes, edge);
  std::vector<float> values(kCubes * static_cast<std::size_t>(sampler.channels()));
  sampler.evaluate_faded(positions.data(), edges.data(), kCubes, values.data());
  light.to_light(values.data(), kCubes);
  return values;
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

}  // namespace solidtex::engine
