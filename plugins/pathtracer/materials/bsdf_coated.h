// BSDF of the materials "diffuse" and "coated".
#pragma once

#include <array>
#include <glm/glm.hpp>

#include "plugins/pathtracer/materials/bsdf_sample.h"

namespace solidtex::pathtracer {

// A rough dielectric layer (GGX) over a diffuse base. Its tabulated directional albedo gives the
// base exactly the light that the coat transmits.
class Coat {
 public:
  Coat(float roughness, float ior);
  // Interpolates the tables of two coats of the same index: (1 - t) smoother + t rougher.
  Coat(const Coat& smoother, const Coat& rougher, float t, float roughness);

  float alpha() const { return alpha_; }
  float ior() const { return ior_; }
  // Reflected fraction of light from a direction with this cosine.
  float albedo(float cosine) const;
  float average_albedo() const { return average_; }
  // Fraction of light from the base that the coat reflects back down.
  float internal_reflectance() const;

 private:
  static constexpr int kEntries = 128;
  float alpha_, ior_, average_ = 0;
  std::array<float, kEntries> table_{};
};

// `coat` is null for "diffuse".
struct CoatedBsdf {
  glm::vec3 albedo{0};
  const Coat* coat = nullptr;

  glm::vec3 eval(const glm::vec3& out, const glm::vec3& in) const;  // times the cosine of `in`
  float pdf(const glm::vec3& out, const glm::vec3& in) const;
  BsdfSample sample(const glm::vec3& out, float lobe, const glm::vec2& u) const;

 private:
  float coat_probability(float cosine) const;
};

}  // namespace solidtex::pathtracer
