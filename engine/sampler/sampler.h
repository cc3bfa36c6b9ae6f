// Evaluator of the sampler family: octave noise -> MLP -> channels (GramGAN, section 3.1, equations
// 1 and 2).
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

// full: float32. fast: bfloat16 products, see docs/numerics.md.
enum class Precision { full, fast };

struct Lookup;
struct PartBuffers;

class Sampler {
 public:
  Sampler(const SamplerModel& model, NoiseScheme scheme, std::uint64_t seed,
          Precision precision = Precision::full);

  int channels() const { return layers_.back().outputs; }

  // Evaluates `count` points on the calling thread. Positions are (x, y, z) triples in texels,
  // values are count x channels. The bits of a point do not depend on the other points. Multiples
  // of kOctaveBlock points are the most efficient.
  void evaluate(const double* positions, std::size_t count, float* values) const;

  // Evaluates points with footprints, in full precision: an octave fades as the footprint covers
  // more of its cells. An empty footprint, or null footprints, gives the bits of evaluate.
  // jacobians receives count x channels x 3 derivatives unless it is null.
  void evaluate_faded(const double* positions, const Spread* footprints, std::size_t count,
                      float* values, float* jacobians = nullptr) const;

  // Returns the fraction of the octaves' variance that a footprint keeps, from 1 to 0.
  float kept(const Spread& footprint) const { return fade_.kept(footprint); }

 private:
  // Evaluates `part` points at a time: a block or one.
  void evaluate_parts(const double* positions, const Spread* footprints, std::size_t count,
                      std::size_t part, float* values, float* jacobians) const;
  void evaluate_part(const double* positions, const Spread* footprints, int count,
                     PartBuffers& buffers, float* values, float* jacobians) const;
  // Evaluates one layer and its derivatives.
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
  // Hidden layers read [previous layer, octave noise]. Layer 0 reads only noise: its constant input
  // is folded into its bias. The last layer is the linear output.
  std::vector<LinearLayer> layers_;
  std::vector<PointLayer> point_layers_;        // the same layers
  std::vector<LinearLayer> derivative_layers_;  // the same layers without bias and activation
  std::vector<PointLayer> point_derivative_layers_;
  std::optional<MatrixNetwork> fast_;  // the hidden layers in fast precision
};

}  // namespace solidtex::engine
