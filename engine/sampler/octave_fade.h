// How much of an octave is left in the mean over a footprint.
#pragma once

#include <array>
#include <vector>

#include "engine/sampler/octave.h"

namespace solidtex::engine {

// What fading needs to know of a footprint with the axes a, b, c, of S = (a a' + b b' + c c') / 2:
// its six entries, those of its cofactors, and its determinant.
struct Spread {
  static constexpr std::size_t kTerms = 13;

  static Spread of(const std::array<std::array<double, 3>, 3>& axes);

  std::array<float, kTerms> terms{};
};

// Those of a block of points, side by side.
struct PlanarSpreads {
  void assign(const Spread* spreads, int count);

  // Half of the terms of cubes are zero: which ones are not, in ascending order.
  std::array<std::size_t, Spread::kTerms> used;
  std::size_t used_count = 0;
  alignas(64) float terms[Spread::kTerms][kOctaveBlock] = {};
};

// What the values of an octave, and their derivatives, are divided by at a block of points.
struct FadeDivisors {
  void apply(int count, float* values) const {
    for (int p = 0; p < count; ++p) values[p] /= divisor[p];
  }
  float divisor[kOctaveBlock];
};

// An octave of transform T is divided by det(I + T S T'). For a cube of edge e whose axes are those
// of the octave's lattice that is the product of 1 + (e |t|)^2 / 8, t the rows of T: less than one
// cell hardly matters, several average out. With 1/4 instead of 1/8 averages over 2 and 4 texels of
// grey stone were missed by a quarter more. What a footprint is narrow in does not fade.
class OctaveFade {
 public:
  explicit OctaveFade(const OctaveBank& octaves);

  FadeDivisors divisors(int octave, const PlanarSpreads& spreads) const;

  // The variance that is left of all octaves together, as if they weighed the same, in [0, 1].
  float kept(const Spread& spread) const;

 private:
  // det(I + T S T') = 1 + <T'T, S> + <cof(T'T), cof(S)> + det(T'T) det(S), which is 1 + a product
  // of two rows of terms, without cancellation however narrow a footprint is. Those of T, where
  // entries off the diagonal count twice, per octave, rounded up to OctaveBank::kStep octaves.
  int octaves_;
  std::array<std::vector<float>, Spread::kTerms> rates_;
};

}  // namespace solidtex::engine
