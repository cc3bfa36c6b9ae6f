// Properties of every BSDF.
#pragma once

#include <algorithm>
#include <cmath>

#include "plugins/pathtracer/materials/bsdf.h"
#include "tests/scenes/directions.h"

namespace scene_tests {

namespace pt = solidtex::pathtracer;

// Compares the histogram of samples on the sphere with the integral of the density. `surplus` is
// the chi-square statistic minus its mean, over its standard deviation: about -3 to 3 if both
// agree.
struct SampleCheck {
  double surplus = 0, valid_share = 0;
  glm::dvec3 mean_weight{0};
  double worst_pdf_error = 0;  // relative, of a sample's pdf against pdf()
};
SampleCheck check_samples(const pt::Bsdf& bsdf, const glm::vec3& out);

// The largest relative difference between both ways over pairs of directions and channels.
template <class AnyBsdf>
double worst_reciprocity_error(const AnyBsdf& bsdf) {
  double worst = 0;
  for (int i = 1; i < 10; ++i) {
    for (int j = 1; j < 10; ++j) {
      const glm::vec3 a = direction(0.1f * static_cast<float>(i), 0.3f);
      const glm::vec3 b = direction(0.1f * static_cast<float>(j), 2.0f);
      const glm::vec3 there = bsdf.eval(a, b) / b.z, back = bsdf.eval(b, a) / a.z;
      for (int c = 0; c < 3; ++c) {
        const double error = std::abs(there[c] - back[c]) / (1e-3 + std::abs(back[c]));
        worst = std::max(worst, error);
      }
    }
  }
  return worst;
}

}  // namespace scene_tests
