// The hidden layers of a sampler on a matrix unit (Intel AMX): bfloat16 products, float32 sums.
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
  static constexpr int kBlock = 2 * kOctaveBlock;  // points per efficient evaluation

  // Returns whether the processor has the unit, the system grants it, and the active target has
  // vectors to match.
  static bool supported();

  // Hidden layers that read [units of the previous layer, octaves]; the first one reads octaves
  // only. The output layer stays in float32: it is small, and its rounding is the most visible.
  explicit MatrixNetwork(std::span<const LinearLayer> layers);

  // Planar working memory of a block of points.
  class Block {
   public:
    // For blocks of up to `points` points.
    Block(const MatrixNetwork& network, int points);

    // Distance between rows in values: the points, rounded up to whole tiles.
    int pitch() const { return pitch_; }
    float* octave(int i) { return octaves_.get() + static_cast<std::ptrdiff_t>(i) * pitch_; }
    const float* units() const { return units_.get(); }

   private:
    friend class MatrixNetwork;
    int pitch_;
    hwy::AlignedFreeUniquePtr<float[]> octaves_, units_;
    hwy::AlignedFreeUniquePtr<std::uint32_t[]> current_, next_;  // [row][pitch]
  };

  // Computes the units of the last layer from the octaves of all layers. Reads and writes whole
  // tiles of points; values beyond `count` are undefined.
  void evaluate(int count, Block& block) const;

 private:
  // Weights of a layer as tiles of 16 outputs x 32 inputs: octaves, then units of the previous
  // layer, each padded with zeros to whole tiles.
  struct Layer {
    int output_tiles, octaves, octave_steps, unit_steps;
    hwy::AlignedFreeUniquePtr<std::uint16_t[]> weights;  // [output tile][step][16][32]
    std::vector<float> bias;                             // [output tile][16]
    float negative_slope;
  };

  static Layer make_layer(const LinearLayer& layer, int units);
  // Writes pairs of units for the next layer, or the values of the last layer.
  static void run_layer(const Layer& layer, int point_tiles, int pitch, const std::uint32_t* inputs,
                        std::uint32_t* pairs, float* values);

  std::vector<Layer> layers_;
  int octaves_ = 0;
  std::size_t octave_rows_ = 0;  // rows of a layer's inputs, two inputs each
  std::size_t rows_ = 0;
};

}  // namespace solidtex::engine
