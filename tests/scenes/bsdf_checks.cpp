#include "tests/scenes/bsdf_checks.h"

#include <algorithm>
#include <vector>

namespace scene_tests {
namespace {

constexpr int kRows = 24, kColumns = 12,
              kFine = 24;  // cells, and integration points per cell and axis
constexpr int kSamples = 60000;

int cell_of(const glm::vec3& d) {
  const float angle = std::atan2(d.y, d.x) / glm::two_pi<float>();
  const int row = static_cast<int>((d.z + 1) / 2 * kRows);
  const int column = static_cast<int>((angle < 0 ? angle + 1 : angle) * kColumns);
  return std::clamp(row, 0, kRows - 1) * kColumns + std::clamp(column, 0, kColumns - 1);
}

std::vector<double> expected_shares(const pt::Bsdf& bsdf, const glm::vec3& out) {
  std::vector<double> shares(kRows * kColumns);
  const int rows = kRows * kFine, columns = kColumns * kFine;
  const double cell = 2 * glm::two_pi<double>() / (rows * columns);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      const glm::vec3 d = direction(
          -1 + 2 * (static_cast<float>(i) + 0.5f) / static_cast<float>(rows),
          glm::two_pi<float>() * (static_cast<float>(j) + 0.5f) / static_cast<float>(columns));
      shares[static_cast<std::size_t>(cell_of(d))] += bsdf.pdf(out, d) * cell;
    }
  }
  return shares;
}

}  // namespace

SampleCheck check_samples(const pt::Bsdf& bsdf, const glm::vec3& out) {
  SampleCheck result;
  std::vector<int> counts(kRows * kColumns);
  Random random(1);
  for (int i = 0; i < kSamples; ++i) {
    const float lobe = random.next(), u = random.next(), v = random.next();
    const pt::BsdfSample sample = bsdf.sample(out, lobe, {u, v});
    if (sample.pdf <= 0) continue;
    result.valid_share += 1.0 / kSamples;
    result.mean_weight += glm::dvec3(sample.weight) / double(kSamples);
    ++counts[static_cast<std::size_t>(cell_of(sample.direction))];
    const double error = std::abs(bsdf.pdf(out, sample.direction) / sample.pdf - 1);
    result.worst_pdf_error = std::max(result.worst_pdf_error, error);
  }
  const std::vector<double> shares = expected_shares(bsdf, out);
  double chi2 = 0, cells = 0, rest = 0;
  int rest_count = 0;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const double expected = shares[i] * kSamples;
    if (expected < 10) {  // too few for chi-square: merged
      rest += expected;
      rest_count += counts[i];
      continue;
    }
    chi2 += (counts[i] - expected) * (counts[i] - expected) / expected;
    ++cells;
  }
  if (rest > 10) {
    chi2 += (rest_count - rest) * (rest_count - rest) / rest;
    ++cells;
  }
  result.surplus = (chi2 - cells) / std::sqrt(2 * cells);
  return result;
}

}  // namespace scene_tests
