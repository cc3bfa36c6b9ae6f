#include "engine/space/colors.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/common/error.h"

namespace solidtex::engine {
namespace {

using Vector3 = std::array<double, 3>;
using Matrix3 = std::array<Vector3, 3>;

// Keeps a gray stone's faint hues from being amplified.
constexpr double min_axis_ratio = 0.15, min_variance = 1e-8;
constexpr int jacobi_sweeps = 32;

// Zeroes matrix[p][q] by a rotation, which is applied to the columns of `vectors` too.
void rotate(Matrix3& matrix, Matrix3& vectors, std::size_t p, std::size_t q) {
  if (matrix[p][q] == 0) return;
  const double theta = (matrix[q][q] - matrix[p][p]) / (2 * matrix[p][q]);
  const double magnitude = theta < 0 ? -theta : theta;
  const double tangent = 1 / (magnitude + std::sqrt(theta * theta + 1)) * (theta < 0 ? -1 : 1);
  const double cosine = 1 / std::sqrt(tangent * tangent + 1), sine = tangent * cosine;
  const auto mix = [&](double& a, double& b) {
    const double before = a;
    a = cosine * before - sine * b;
    b = sine * before + cosine * b;
  };
  for (std::size_t k = 0; k < 3; ++k) mix(matrix[k][p], matrix[k][q]);
  for (std::size_t k = 0; k < 3; ++k) mix(matrix[p][k], matrix[q][k]);
  for (std::size_t k = 0; k < 3; ++k) mix(vectors[k][p], vectors[k][q]);
  matrix[p][q] = matrix[q][p] = 0;
}

struct Axis {
  double variance = 0;
  Vector3 direction{};
};

// Returns the eigenvectors of a symmetric matrix by descending variance.
std::array<Axis, 3> principal_axes(Matrix3 covariance) {
  Matrix3 vectors{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (int sweep = 0; sweep < jacobi_sweeps; ++sweep)
    for (const auto& [p, q] : {std::pair<std::size_t, std::size_t>{0, 1}, {0, 2}, {1, 2}})
      rotate(covariance, vectors, p, q);
  std::array<Axis, 3> axes;
  for (std::size_t k = 0; k < 3; ++k)
    axes[k] = {covariance[k][k], {vectors[0][k], vectors[1][k], vectors[2][k]}};
  std::ranges::stable_sort(axes, std::ranges::greater{}, &Axis::variance);
  return axes;
}

// Each axis points to where the sum of the channels grows.
Colors colors_of(const Vector3& mean, const Matrix3& covariance) {
  Colors colors{};
  double largest = 0;
  const auto axes = principal_axes(covariance);
  for (std::size_t k = 0; k < 3; ++k) {
    double deviation = std::sqrt(std::max(axes[k].variance, min_variance));
    if (k == 0) largest = deviation;
    deviation = std::max(deviation, min_axis_ratio * largest);
    const Vector3& v = axes[k].direction;
    const double sign = v[0] + v[1] + v[2] < 0 ? -1 : 1;
    for (std::size_t r = 0; r < 3; ++r)
      colors[4 * r + k] = static_cast<float>(sign * v[r] * deviation);
  }
  for (std::size_t r = 0; r < 3; ++r) colors[4 * r + 3] = static_cast<float>(mean[r]);
  return colors;
}

Colors blend_colors(std::span<const Material> materials, std::span<const double> weights) {
  Vector3 mean{};
  Matrix3 covariance{};
  for (std::size_t i = 0; i < materials.size(); ++i) {
    const auto entry = [&](std::size_t r, std::size_t k) {
      return double{materials[i].colors[4 * r + k]};
    };
    for (std::size_t r = 0; r < 3; ++r) {
      mean[r] += weights[i] * entry(r, 3);
      for (std::size_t s = 0; s < 3; ++s)
        for (std::size_t k = 0; k < 3; ++k)
          covariance[r][s] += weights[i] * (entry(r, k) * entry(s, k));
    }
  }
  return colors_of(mean, covariance);
}

std::vector<float> blend_codes(std::span<const Material> materials,
                               std::span<const double> weights) {
  std::vector<double> sums(materials.front().code.size());
  for (std::size_t i = 0; i < sums.size(); ++i)
    for (std::size_t k = 0; k < materials.size(); ++k) sums[i] += weights[k] * materials[k].code[i];
  std::vector<float> code(sums.size());
  std::ranges::transform(sums, code.begin(), [](double x) { return static_cast<float>(x); });
  return code;
}

std::vector<double> normalized(std::span<const double> weights) {
  double sum = 0;
  for (const double weight : weights) sum += weight;
  if (!(sum > 0) || !std::isfinite(sum))
    throw Error(SOLIDTEX_INVALID_ARGUMENT,
                "the sum of weights is " + std::to_string(sum) + ", expected a positive number");
  std::vector<double> result(weights.begin(), weights.end());
  for (double& weight : result) weight /= sum;
  return result;
}

}  // namespace

Colors photograph_colors(std::span<const float> pixels) {
  const std::size_t count = pixels.size() / 3;
  Vector3 mean{};
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t r = 0; r < 3; ++r) mean[r] += pixels[3 * i + r];
  for (double& m : mean) m /= static_cast<double>(count);
  Matrix3 covariance{};
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t s = 0; s <= r; ++s)
        covariance[r][s] += (pixels[3 * i + r] - mean[r]) * (pixels[3 * i + s] - mean[s]);
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t s = 0; s <= r; ++s)
      covariance[s][r] = covariance[r][s] /= static_cast<double>(count - 1);
  return colors_of(mean, covariance);
}

Material blend(const Space& space, std::span<const Material> materials,
               std::span<const double> weights) {
  const std::vector<double> shares = normalized(weights);
  return {blend_codes(materials, shares),
          space.has_colors ? blend_colors(materials, shares) : Colors{}};
}

}  // namespace solidtex::engine
