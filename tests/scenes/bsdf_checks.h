// What must be true of every BSDF.
#pragma once

#include "plugins/pathtracer/bsdf.h"
#include "tests/scenes/directions.h"

namespace scene_tests {

namespace pt = solidtex::pathtracer;

// Of many samples: their share in each cell of a grid on the sphere against the integral of the
// density there, as chi-square over its expected deviation above its mean (about -3 to 3 when both
// agree), and their mean weight.
struct SampleCheck {
  double surplus = 0, valid_share = 0;
  glm::dvec3 mean_weight{0};
  double worst_pdf_error = 0;  // of a sample's pdf against pdf(), relative
};
SampleCheck check_samples(const pt::Bsdf& bsdf, const glm::vec3& out);

}  // namespace scene_tests
