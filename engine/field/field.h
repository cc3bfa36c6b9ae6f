// Lattice family: required regions backward, evaluation forward, on absolute integer coordinates.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/field/box.h"
#include "engine/model/model.h"

namespace solidtex::engine {

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
  FieldModel model_;
  NoiseScheme scheme_;
  std::uint64_t seed_;
};

}  // namespace solidtex::engine
