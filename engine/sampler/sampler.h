// Point family: octave noise -> MLP -> channels (GramGAN section 3.1, equations 1 and 2).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/kernels/linear_layer.h"
#include "engine/model/model.h"
#include "engine/sampler/matrix_network.h"
#include "engine/sampler/octave.h"
#include "engine/sampler/octave_fade.h"

namespace solidtex::engine {

// Full: float32 throughout. Fast: see docs/numerics.md.
enum class Precision { full, fast };

struct Lookup;
struct PartBuffers;

class Sampler {
 public:
  Sampler(const SamplerModel& model, NoiseScheme scheme, std::uint64_t seed,
          Precision precision = Precision::full);

  int channels() const { return layers_.back().outputs; }

  // Evaluates `count` points on the calling thread. Positions are double (x, y, z) triples in
  // texels; values are count x channels. The bits of a point do not depend on its neighbours.
  // Most efficient in multiples of kOctaveBlock points.
  void evaluate(const double* positions, std::size_t count, float* values) const;

  // The same with octaves faded: each point has a footprint, and an octave counts the less the more
  // of its cells that covers. An empty one, or null for none of any point, gives the bits of
  // evaluate. Where asked for, also how values change with the position: count x channels x 3. All
  // in full precision.
  void evaluate_faded(const double* positions, const Spread* footprints, std::size_t count,
                      float* values, float* jacobians = nullptr) const;

  // How much fading leaves of the octaves' variance: 1 of an empty footprint, 0 of a vast one.
  float kept(const Spread& footprint) const { return fade_.kept(footprint); }

 private:
  // So many points at a time: a block, or one.
  void evaluate_parts(const double* positions, const Spread* footprints, std::size_t count,
                      std::size_t part, float* values, float* jacobians) const;
  void evaluate_part(const double* positions, const Spread* footprints, int count,
                     PartBuffers& buffers, float* values, float* jacobians) const;
  // One layer, and the same for the derivatives of its inputs.
  void block_layer(std::size_t layer, int count, PartBuffers& buffers) const;
  void point_layer(std::size_t layer, PartBuffers& buffers) const;
  void evaluate_fast(const double* positions, std::size_t count, float* values) const;
  void octave_noise(int octave, int count, Lookup& lookup, float* values) const;
  void octave_derivatives(int octave, int count, Lookup& lookup, float* values,
                          float* const* derivatives) const;
  void block_noise(const double* positions, int count, MatrixNetwork::Block& block) const;
  void evaluate_point(const double* position, float* values) const;
  void point_noise(const double* position, float* values) const;
  std::size_t activation_rows() const;

  int width_, octaves_per_layer_;
  OctaveBank octaves_;
  OctaveFade fade_;
  // The hidden layers read [previous layer, octave noise]; layer 0 reads noise only, since its
  // constant input is part of its bias. The last one is the linear output.
  std::vector<LinearLayer> layers_;
  std::vector<PointLayer> point_layers_;        // the same
  std::vector<LinearLayer> derivative_layers_;  // without biases and activations
  std::vector<PointLayer> point_derivative_layers_;
  std::optional<MatrixNetwork> fast_;  // the same, where fast precision is asked for and there
};

}  // namespace solidtex::engine
