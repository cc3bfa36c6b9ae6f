// Fading of octaves: how much of an octave remains in the mean over a footprint.
#pragma once

#include <array>
#include <vector>

#include "engine/sampler/octave.h"

namespace solidtex::engine {

// Terms of a footprint with the axes a, b, c: the matrix S = (a a' + b b' + c c') / 2, its six
// entries, those of its cofactors, and its determinant.
struct Spread {
  static constexpr std::size_t kTerms = 13;

  static Spread of(const std::array<std::array<double, 3>, 3>& axes);

  std::array<float, kTerms> terms{};
};

// Terms of a block of points, planar.
struct PlanarSpreads {
  void assign(const Spread* spreads, int count);

  // Indices of the terms that are not zero, ascending. Half of a cube's terms are zero.
  std::array<std::size_t, Spread::kTerms> used;
  std::size_t used_count = 0;
  alignas(64) float terms[Spread::kTerms][kOctaveBlock] = {};
};

// Divisors of an octave's values and derivatives at a block of points.
struct FadeDivisors {
  void apply(int count, float* values) const {
    for (int p = 0; p < count; ++p) values[p] /= divisor[p];
  }
  float divisor[kOctaveBlock];
};

// An octave with the transform T is divided by det(I + T S T'). For a cube with edge e along the
// axes of the octave's lattice this is the product of 1 + (e |t|)^2 / 8 over the rows t of T: less
// than one cell hardly fades, several cells average out. Where a footprint is narrow nothing fades.
// docs/experiments/engine-constants.md compares the factor 1/8 with others.
class OctaveFade {
 public:
  explicit OctaveFade(const OctaveBank& octaves);

  FadeDivisors divisors(int octave, const PlanarSpreads& spreads) const;

  // Returns the fraction of the variance of all octaves, equally weighted, that remains.
  float kept(const Spread& spread) const;

 private:
  // det(I + T S T') = 1 + <T'T, S> + <cof(T'T), cof(S)> + det(T'T) det(S) is 1 plus a product of
  // two rows of terms, without cancellation for narrow footprints. These are the terms of T per
  // octave, entries off the diagonal doubled, rounded up to OctaveBank::kStep octaves.
  int octaves_;
  std::array<std::vector<float>, Spread::kTerms> rates_;
};

}  // namespace solidtex::engine
