// The sampler's hidden layers on a processor's matrix unit (Intel AMX): bfloat16 products, float32
// sums.
#pragma once

#include <hwy/aligned_allocator.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/kernels/linear_layer.h"
#include "engine/sampler/octave.h"

namespace solidtex::engine {

class MatrixNetwork {
 public:
  static constexpr int kBlock = 2 * kOctaveBlock;  // points that are best evaluated at a time

  // Whether this processor has the unit, the system lets this process use it, and the targets of
  // the other kernels (a test may choose) have vectors to go with it.
  static bool supported();

  // Hidden layers that read [units of the layer before, octaves], the first one octaves only. The
  // output layer is left to float32: it is small, and its rounding would show most.
  explicit MatrixNetwork(std::span<const LinearLayer> layers);

  // What blocks of points need, planar.
  class Block {
   public:
    // For up to `points` of them, one block after another.
    Block(const MatrixNetwork& network, int points);

    // Rows are so many values apart: the points in whole tiles.
    int pitch() const { return pitch_; }
    float* octave(int i) { return octaves_.get() + static_cast<std::ptrdiff_t>(i) * pitch_; }
    const float* units() const { return units_.get(); }

   private:
    friend class MatrixNetwork;
    int pitch_;
    hwy::AlignedFreeUniquePtr<float[]> octaves_, units_;
    hwy::AlignedFreeUniquePtr<std::uint32_t[]> current_, next_;  // [row][pitch]
  };

  // From the octaves of all layers to the units of the last one. Reads and writes whole tiles of
  // points: what lies behind `count` is no result.
  void evaluate(int count, Block& block) const;

 private:
  // One layer's weights as tiles of 16 outputs x 32 inputs: octaves, then units of the layer
  // before, each rounded up to whole tiles with zeros.
  struct Layer {
    int output_tiles, octaves, octave_steps, unit_steps;
    hwy::AlignedFreeUniquePtr<std::uint16_t[]> weights;  // [output tile][step][16][32]
    std::vector<float> bias;                             // [output tile][16]
    float negative_slope;
  };

  static Layer make_layer(const LinearLayer& layer, int units);
  // Gives pairs of units to the next layer, or the values of the last layer's.
  static void run_layer(const Layer& layer, int point_tiles, int pitch, const std::uint32_t* inputs,
                        std::uint32_t* pairs, float* values);

  std::vector<Layer> layers_;
  int octaves_ = 0;
  std::size_t octave_rows_ = 0;  // of a layer's inputs; a row is a pair of them
  std::size_t rows_ = 0;
};

}  // namespace solidtex::engine
