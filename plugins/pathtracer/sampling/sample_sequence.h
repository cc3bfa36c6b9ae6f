// Sample sequences: the random numbers of a path, one (0,2)-sequence per pixel and dimension.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "plugins/common/hash.h"
#include "plugins/pathtracer/sampling/sobol.h"
#include "plugins/pathtracer/sampling/vectorized.h"

namespace solidtex::pathtracer {

// Dimensions of a path.
inline constexpr std::uint32_t kPixel = 0, kLens = 1, kFirstBounce = 2;

// Dimensions of one bounce, relative to dimension(depth).
enum Dimension : std::uint32_t { kLight, kLobe, kDirection, kRoulette, kCount };

inline std::uint32_t dimension(int depth) {
  return kFirstBounce + static_cast<std::uint32_t>(depth - 1) * kCount;
}

// Dimensions of stochastic texture filtering, far from the others so that these do not change with
// the filter.
inline constexpr std::uint32_t kJitter = 1u << 24;

// Stateless: a number is a function of seed, pixel, sample and dimension, so the result depends on
// neither thread nor order. Each dimension (or pair of dimensions) is an independently shuffled and
// scrambled Sobol' sequence.
class SampleSequence {
 public:
  SampleSequence() = default;
  SampleSequence(std::uint64_t seed, std::uint32_t pixel, std::uint32_t sample)
      : pixel_key_(mix(mix(seed) + pixel)), sample_(sample) {}

  float get_1d(std::uint32_t dimension) const {
    const std::uint64_t key = mix(pixel_key_ + dimension);
    return to_unit(scrambled_sobol_0(shuffle(sample_, high(key)), low(key)));
  }

  // Shuffle and scramble seeds of a dimension's pairs, equal for all samples of a pixel.
  struct PairSeeds {
    std::uint32_t order, x, y;
  };
  PairSeeds pair_seeds(std::uint32_t dimension) const {
    const std::uint64_t key = mix(pixel_key_ + dimension);
    return {high(key), low(key), low(mix(key))};
  }
  static glm::vec2 pair(std::uint32_t sample, const PairSeeds& seeds) {
    const std::uint32_t index = shuffle(sample, seeds.order);
    return {to_unit(scrambled_sobol_0(index, seeds.x)), to_unit(scrambled_sobol_1(index, seeds.y))};
  }
  glm::vec2 get_2d(std::uint32_t dimension) const { return pair(sample_, pair_seeds(dimension)); }

  SampleSequence of_sample(std::uint32_t sample) const {
    SampleSequence result = *this;
    result.sample_ = sample;
    return result;
  }
  std::uint32_t sample() const { return sample_; }
  bool shares_pixel_with(const SampleSequence& other) const {
    return pixel_key_ == other.pixel_key_;
  }

 private:
  static std::uint32_t low(std::uint64_t key) { return static_cast<std::uint32_t>(key); }
  static std::uint32_t high(std::uint64_t key) { return static_cast<std::uint32_t>(key >> 32); }
  // Signed, because vector units convert signed integers in one instruction.
  static float to_unit(std::uint32_t x) {
    return static_cast<float>(static_cast<std::int32_t>(x >> 8)) * 0x1p-24f;
  }

  std::uint64_t pixel_key_ = 0;
  std::uint32_t sample_ = 0;
};

// SampleSequence::get_2d of a batch of paths, vectorized.
class SamplePairs {
 public:
  // Draws from sequence_of(i), i < count <= kBatchSize. Fast if most neighbors share a pixel.
  template <class SequenceOf>
  void draw(int count, std::uint32_t dimension, const SequenceOf& sequence_of) {
    SampleSequence::PairSeeds seeds{};
    for (int i = 0; i < count; ++i) {
      const SampleSequence& sequence = sequence_of(i);
      if (i == 0 || !sequence.shares_pixel_with(sequence_of(i - 1))) {
        seeds = sequence.pair_seeds(dimension);
      }
      sample_[i] = sequence.sample();
      order_[i] = seeds.order, scramble_x_[i] = seeds.x, scramble_y_[i] = seeds.y;
    }
    scramble(count);
  }
  glm::vec2 operator[](int i) const { return {x[i], y[i]}; }

  alignas(64) float x[kBatchSize]{}, y[kBatchSize]{};

 private:
  void scramble(int count);

  alignas(64) std::uint32_t sample_[kBatchSize]{}, order_[kBatchSize]{};
  alignas(64) std::uint32_t scramble_x_[kBatchSize]{}, scramble_y_[kBatchSize]{};
};

}  // namespace solidtex::pathtracer
