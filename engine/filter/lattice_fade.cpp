#include "engine/filter/lattice_fade.h"

#include <array>
#include <cstdint>

#include "engine/common/parallel.h"

namespace solidtex::engine {
namespace {

constexpr std::int64_t kEdge = 64, kDistance = 1 << 14;  // of the boxes, in texels
constexpr std::size_t kBoxes = 8;

// A cube of voxels, [x][y][z][channel].
struct Cube {
  std::int64_t edge = 0;
  std::size_t channels = 0;
  std::vector<float> values;

  void halve_edge() {
    std::array<std::int64_t, 3> size = {edge, edge, edge};
    halve(size, channels, values.data());
    edge /= 2;
    values.resize(static_cast<std::size_t>(edge * edge * edge) * channels);
  }
};

Cube box_of(const Lattice& lattice, const LightChannels& light, std::size_t number, int level) {
  Box box;
  box.lo = {static_cast<std::int64_t>(number) * kDistance, 0, 0};
  box.hi = {box.lo[0] + kEdge, kEdge, kEdge};
  Cube cube{kEdge, static_cast<std::size_t>(lattice.channels()), {}};
  cube.values.resize(static_cast<std::size_t>(kEdge * kEdge * kEdge) * cube.channels);
  lattice.evaluate_endless(box, cube.values.data());  // a period would repeat these boxes
  light.to_light(cube.values.data(), cube.values.size() / cube.channels);
  for (int halved = 0; halved < level; ++halved) cube.halve_edge();
  return cube;
}

// Appends, for each voxel of `fine`, the voxel of `coarse` that contains it.
void append_parents(const Cube& fine, const Cube& coarse, std::vector<float>& parents) {
  const std::int64_t ratio = fine.edge / coarse.edge;
  for (std::int64_t x = 0; x < fine.edge; ++x)
    for (std::int64_t y = 0; y < fine.edge; ++y)
      for (std::int64_t z = 0; z < fine.edge; ++z) {
        const std::int64_t voxel =
            ((x / ratio) * coarse.edge + y / ratio) * coarse.edge + z / ratio;
        const float* from = &coarse.values[static_cast<std::size_t>(voxel) * coarse.channels];
        parents.insert(parents.end(), from, from + coarse.channels);
      }
}

}  // namespace

void halve(std::array<std::int64_t, 3>& size, std::size_t channels, float* values) {
  const auto step = static_cast<std::ptrdiff_t>(channels);
  const std::ptrdiff_t y_pitch = size[2] * step, x_pitch = size[1] * y_pitch;
  for (std::int64_t& extent : size) extent /= 2;
  float* mean = values;  // never ahead of what is still to be read
  for (std::int64_t x = 0; x < size[0]; ++x)
    for (std::int64_t y = 0; y < size[1]; ++y)
      for (std::int64_t z = 0; z < size[2]; ++z) {
        const float* at = values + 2 * (x * x_pitch + y * y_pitch + z * step);
        for (std::size_t c = 0; c < channels; ++c, ++at) {
          const auto pair = [&](const float* p) { return p[0] + p[step]; };
          const float low = pair(at) + pair(at + y_pitch);
          const float high = pair(at + x_pitch) + pair(at + x_pitch + y_pitch);
          *mean++ = 0.125f * (low + high);
        }
      }
}

std::vector<FadeStep> fade_steps_of(const Lattice& lattice, const LightChannels& light, int level) {
  const auto channels = static_cast<std::size_t>(lattice.channels());
  std::vector<Cube> cubes(kBoxes);
  for_each_part(kBoxes, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) cubes[i] = box_of(lattice, light, i, level);
  });
  std::vector<float> values;
  for (const Cube& cube : cubes)
    values.insert(values.end(), cube.values.begin(), cube.values.end());
  std::vector<FadeStep> steps = {no_fade(channels)};
  std::vector<Cube> coarse = cubes;
  for (int step = 1; step < kFadeSteps; ++step) {
    std::vector<float> truths;
    for (std::size_t i = 0; i < kBoxes; ++i) {
      coarse[i].halve_edge();
      append_parents(cubes[i], coarse[i], truths);
    }
    steps.push_back(fit_fade(values, truths, channels));
  }
  steps.push_back(only_mean(values, channels));
  return steps;
}

}  // namespace solidtex::engine
