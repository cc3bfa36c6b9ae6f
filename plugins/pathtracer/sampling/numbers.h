// Pairs of random numbers for many paths at once: those of Sampler::get_2d, in vector code.
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>

#include "plugins/pathtracer/sampling/sampling.h"
#include "plugins/pathtracer/sampling/vectorized.h"

namespace solidtex::pathtracer {

class NumberPairs {
 public:
  // For sampler_of(i), i < count <= kTogether, of which neighbours are mostly of one pixel.
  template <class SamplerOf>
  void draw(int count, std::uint32_t dimension, const SamplerOf& sampler_of) {
    Sampler::PairSeeds seeds{};
    for (int i = 0; i < count; ++i) {
      const Sampler& sampler = sampler_of(i);
      if (i == 0 || !sampler.is_of_pixel_of(sampler_of(i - 1))) {
        seeds = sampler.pair_seeds(dimension);
      }
      sample_[i] = sampler.sample();
      order_[i] = seeds.order, scramble_x_[i] = seeds.x, scramble_y_[i] = seeds.y;
    }
    scramble(count);
  }
  glm::vec2 operator[](int i) const { return {x[i], y[i]}; }

  alignas(64) float x[kTogether]{}, y[kTogether]{};

 private:
  void scramble(int count);

  alignas(64) std::uint32_t sample_[kTogether]{}, order_[kTogether]{};
  alignas(64) std::uint32_t scramble_x_[kTogether]{}, scramble_y_[kTogether]{};
};

}  // namespace solidtex::pathtracer
