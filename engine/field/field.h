// Lattice family: required regions backward, evaluation forward, on absolute integer coordinates.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/field/box.h"
#include "engine/kernels/linear_layer.h"
#include "engine/model/model.h"

namespace solidtex::engine {

class Block;

// The exact box every node must be known on so that the output is known on `output`; same order as
// model.nodes. Backward pass: conv3d widens, upsample halves with floor, several consumers unite.
std::vector<Box> required_regions(const FieldModel& model, const Box& output);

class Field {
 public:
  Field(FieldModel model, NoiseScheme scheme, std::uint64_t seed);

  int channels() const;

  // Evaluates one block on the calling thread; values in [x][y][z][channel] order. Memory grows
  // with the box: callers split large boxes (texture/ does), any split gives the same bits.
  void evaluate(const Box& box, float* values) const;

 private:
  // What the constructor finds out about a node.
  struct Plan {
    LinearLayer layer;         // of a convolution
    std::size_t last_use = 0;  // index of the last node that reads it
    bool fused = false;        // a leaky ReLU that its convolution has already applied
  };

  void plan_layers();
  void plan_uses();
  Block compute(std::size_t index, const Box& region, std::vector<Block>& blocks) const;

  FieldModel model_;
  NoiseScheme scheme_;
  std::uint64_t seed_;
  std::vector<Plan> plans_;
};

}  // namespace solidtex::engine
