// BSDF of a material evaluated at a shading point. Directions are in the local frame, whose z is
// the normal on the viewer's side, and point away from the surface. All BSDFs are reciprocal
// (refraction up to the square of the index) and conserve energy.
#pragma once

#include <glm/glm.hpp>
#include <utility>
#include <variant>

#include "plugins/pathtracer/materials/bsdf_coated.h"
#include "plugins/pathtracer/materials/bsdf_dielectric.h"
#include "plugins/pathtracer/materials/bsdf_principled.h"
#include "plugins/pathtracer/materials/bsdf_sample.h"

namespace solidtex::pathtracer {

class Bsdf {
 public:
  template <class Kind>
  explicit Bsdf(Kind kind) : kind_(std::move(kind)) {}

  // Returns the BSDF times the cosine of `in`.
  glm::vec3 eval(const glm::vec3& out, const glm::vec3& in) const {
    return std::visit([&](const auto& bsdf) { return bsdf.eval(out, in); }, kind_);
  }
  // Returns the density of sample() per solid angle.
  float pdf(const glm::vec3& out, const glm::vec3& in) const {
    return std::visit([&](const auto& bsdf) { return bsdf.pdf(out, in); }, kind_);
  }
  // Whether sample() uses its argument `lobe`.
  bool has_lobes() const {
    const auto* coated = std::get_if<CoatedBsdf>(&kind_);
    return !coated || coated->coat;
  }
  // Samples `in`. `lobe` and `u` are uniform in [0, 1).
  BsdfSample sample(const glm::vec3& out, float lobe, const glm::vec2& u) const {
    return std::visit([&](const auto& bsdf) { return bsdf.sample(out, lobe, u); }, kind_);
  }

 private:
  std::variant<CoatedBsdf, PrincipledBsdf, DielectricBsdf> kind_;
};

}  // namespace solidtex::pathtracer
