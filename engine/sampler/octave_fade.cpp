#include "engine/sampler/octave_fade.h"

#include <algorithm>

namespace solidtex::engine {
namespace {

using Vector = std::array<double, 3>;
using Terms = std::array<double, Spread::kTerms>;

// Keeps products of terms finite for every file.
constexpr double kLimit = 1e15;

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// Adds v v' as xx, yy, zz, xy, xz, yz.
void add_products(const Vector& v, double* sum) {
  const auto& [x, y, z] = v;
  const double product[6] = {x * x, y * y, z * z, x * y, x * z, y * z};
  for (std::size_t i = 0; i < 6; ++i) sum[i] += product[i];
}

// Terms of the matrix M = sum of v v': its entries, those of its cofactors, its determinant.
Terms terms_of(const std::array<Vector, 3>& vectors) {
  Terms terms{};
  const auto& [a, b, c] = vectors;
  for (const Vector& v : vectors) add_products(v, &terms[0]);
  for (const Vector& v : {cross(b, c), cross(c, a), cross(a, b)}) add_products(v, &terms[6]);
  const Vector area = cross(b, c);
  const double volume = a[0] * area[0] + a[1] * area[1] + a[2] * area[2];
  terms[12] = volume * volume;
  return terms;
}

}  // namespace

Spread Spread::of(const std::array<std::array<double, 3>, 3>& axes) {
  const Terms whole = terms_of(axes);
  Spread spread;
  for (std::size_t k = 0; k < kTerms; ++k) {
    const double halves = k < 6 ? 0.5 : k < 12 ? 0.25 : 0.125;
    spread.terms[k] = static_cast<float>(halves * whole[k]);
  }
  return spread;
}

void PlanarSpreads::assign(const Spread* spreads, int count) {
  used_count = 0;
  for (std::size_t k = 0; k < Spread::kTerms; ++k) {
    bool is_used = false;
    for (int p = 0; p < count; ++p) {
      terms[k][p] = spreads[p].terms[k];
      is_used = is_used || terms[k][p] != 0;
    }
    if (is_used) used[used_count++] = k;
  }
}

OctaveFade::OctaveFade(const OctaveBank& octaves) : octaves_(octaves.count) {
  for (auto& rates : rates_) rates.resize(octaves.padded());
  for (int octave = 0; octave < octaves_; ++octave) {
    const std::array<double, 9> t = octaves.transform_of(octave);
    const Terms terms =
        terms_of({Vector{t[0], t[1], t[2]}, Vector{t[3], t[4], t[5]}, Vector{t[6], t[7], t[8]}});
    for (std::size_t k = 0; k < Spread::kTerms; ++k) {
      const bool off_diagonal = k < 12 && k % 6 >= 3;
      const double rate = std::clamp(terms[k], -kLimit, kLimit);
      rates_[k][static_cast<std::size_t>(octave)] =
          static_cast<float>(off_diagonal ? 2 * rate : rate);
    }
  }
}

FadeDivisors OctaveFade::divisors(int octave, const PlanarSpreads& spreads) const {
  FadeDivisors result;
  auto& sums = result.divisor;
  std::ranges::fill(sums, 0.0f);
  for (std::size_t i = 0; i < spreads.used_count; ++i) {
    const std::size_t k = spreads.used[i];
    const float rate = rates_[k][static_cast<std::size_t>(octave)];
    for (int p = 0; p < kOctaveBlock; ++p) sums[p] += rate * spreads.terms[k][p];
  }
  // Only rounding makes a sum negative.
  for (float& sum : sums) sum = 1 + std::max(sum, 0.0f);
  return result;
}

float OctaveFade::kept(const Spread& spread) const {
  constexpr int kStep = OctaveBank::kStep;
  float kept = 0;
  for (int first = 0; first < octaves_; first += kStep) {
    float sums[kStep] = {};
    for (std::size_t k = 0; k < Spread::kTerms; ++k) {
      const float* rates = &rates_[k][static_cast<std::size_t>(first)];
      for (int i = 0; i < kStep; ++i) sums[i] += rates[i] * spread.terms[k];
    }
    for (int i = 0; i < kStep; ++i) {
      const float left = 1 / (1 + std::max(sums[i], 0.0f));
      sums[i] = left * left;
    }
    for (int i = 0; i < std::min(kStep, octaves_ - first); ++i) kept += sums[i];
  }
  return kept / static_cast<float>(octaves_);
}

}  // namespace solidtex::engine
