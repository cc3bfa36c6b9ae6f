// Point family: octave noise -> MLP -> channels (GramGAN section 3.1, equations 1 and 2).
#pragma once

#include <cstdint>

#include "engine/model/model.h"

namespace solidtex::engine {

class Sampler {
 public:
  Sampler(SamplerModel model, NoiseScheme scheme, std::uint64_t seed);

  int channels() const;

  // Evaluates `count` points on the calling thread. Positions are double (x, y, z) triples in
  // texels; values are count x channels. The bits of a point do not depend on its neighbours.
  void evaluate(const double* positions, std::size_t count, float* values) const;

 private:
  SamplerModel model_;  // layer 0 is folded: its constant input is part of its bias
  NoiseScheme scheme_;
  std::uint64_t seed_;
};

}  // namespace solidtex::engine
