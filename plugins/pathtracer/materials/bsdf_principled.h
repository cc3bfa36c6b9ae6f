// BSDF of the material "principled": a blend of a metal and of a diffuse body under a rough
// interface, below a clear coat.
#pragma once

#include <glm/glm.hpp>

#include "plugins/pathtracer/materials/albedo_table.h"
#include "plugins/pathtracer/materials/bsdf_sample.h"

namespace solidtex::pathtracer {

// The diffuse body receives the light that the rough interface transmits, and a diffuse lobe
// compensates the energy that metal facets lose by shadowing each other, so that white without a
// coat reflects all light. A coat of transmittance T attenuates the base by min(T(out), T(in)):
// reciprocal, exact over a mirror, up to 5 % too dark over white.
class PrincipledBsdf {
 public:
  // All from 0 to 1. Roughness is clamped to kMinRoughness.
  struct Parameters {
    glm::vec3 color{0};
    float roughness = 0.5f, metallic = 0, specular = 1, coat = 0, coat_roughness = 0;
  };
  struct Tables {
    explicit Tables(float ior) : ior(ior), interface(AlbedoTable::reflection(ior)) {}
    float ior;
    AlbedoTable interface;
    AlbedoTable coat = AlbedoTable::reflection(kCoatIor);
  };
  // Keeps a reference to `tables`.
  PrincipledBsdf(const Parameters& parameters, const Tables& tables);

  glm::vec3 eval(const glm::vec3& out, const glm::vec3& in) const;
  float pdf(const glm::vec3& out, const glm::vec3& in) const;
  BsdfSample sample(const glm::vec3& out, float lobe, const glm::vec2& u) const;

 private:
  static constexpr float kCoatIor = 1.5f;

  struct LobeProbabilities {
    float coat, interface, diffuse;
  };
  LobeProbabilities lobe_probabilities(float cosine) const;
  float coat_albedo(float cosine) const;
  float interface_albedo(float cosine) const;
  glm::vec3 base(const glm::vec3& out, const glm::vec3& in, const glm::vec3& h) const;

  Parameters p_;
  const Tables* tables_;
  float alpha_, coat_alpha_;
  float interface_average_, mirror_average_;
  glm::vec3 multiple_{0};  // color of multiple scattering between metal facets
};

}  // namespace solidtex::pathtracer
