// The material "principled": a metal or a diffuse body under a rough interface, mixed, under a
// clear coat.
#pragma once

#include <glm/glm.hpp>

#include "plugins/pathtracer/materials/albedo_table.h"
#include "plugins/pathtracer/materials/bsdf_sample.h"

namespace solidtex::pathtracer {

// Energy: what a rough interface does not reflect reaches the diffuse body, and what metal facets
// lose by shadowing each other comes back as a diffuse lobe, so that white without a coat gives
// back all light. Beneath a coat, light goes in and out by min(T(out), T(in)), T being what the
// coat lets through: reciprocal, exact over a mirror, up to 5 % too dark over white.
class PrincipledBsdf {
 public:
  // Shares are from 0 to 1, and so is roughness, of which less than kMinRoughness is that.
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

  struct Shares {  // probabilities of the lobes
    float coat, interface, diffuse;
  };
  Shares shares(float cosine) const;
  float coat_albedo(float cosine) const;
  float interface_albedo(float cosine) const;
  glm::vec3 base(const glm::vec3& out, const glm::vec3& in, const glm::vec3& h) const;

  Parameters p_;
  const Tables* tables_;
  float alpha_, coat_alpha_;
  float interface_average_, mirror_average_;
  glm::vec3 many_{0};  // color of light that metal facets reflect more than once
};

}  // namespace solidtex::pathtracer
