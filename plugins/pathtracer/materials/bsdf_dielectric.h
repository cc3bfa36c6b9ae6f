// The material "dielectric": a rough interface through which light is refracted (Walter et al.,
// "Microfacet Models for Refraction through Rough Surfaces", 2007).
#pragma once

#include <glm/glm.hpp>

#include "plugins/pathtracer/materials/albedo_table.h"
#include "plugins/pathtracer/materials/bsdf_sample.h"

namespace solidtex::pathtracer {

// Energy: what single scattering loses is given back by diffuse lobes on both sides (Kulla and
// Conty 2017), so that a clear interface neither gains nor loses light. Radiance that is refracted
// into the denser side grows by the square of the index.
class DielectricBsdf {
 public:
  class Tables {
   public:
    explicit Tables(float ior);

    float ior() const { return ior_; }
    // Seen from outside (0) or inside (1).
    const AlbedoTable& albedo(bool inside) const { return albedo_[inside ? 1 : 0]; }
    // Share of light scattered more than once that ends on the other side.
    float through(bool inside, float roughness) const;

   private:
    float ior_;
    AlbedoTable albedo_[2];
    float open_[2];  // mean over the hemisphere of what a smooth interface lets through
  };

  // `color`: what is left of light that goes through. Keeps a reference to `tables`.
  DielectricBsdf(const glm::vec3& color, float roughness, bool inside, const Tables& tables);

  glm::vec3 eval(const glm::vec3& out, const glm::vec3& in) const;
  float pdf(const glm::vec3& out, const glm::vec3& in) const;
  BsdfSample sample(const glm::vec3& out, float lobe, const glm::vec2& u) const;

 private:
  glm::vec3 half_vector(const glm::vec3& out, const glm::vec3& in) const;
  float refraction_jacobian(const glm::vec3& out, const glm::vec3& in, const glm::vec3& h) const;
  float lost(float cosine) const;  // by single scattering, from the viewer's side

  glm::vec3 color_;
  float roughness_, alpha_;
  bool inside_;
  float ior_;      // of the far side over the near side
  float through_;  // as Tables::through
  const Tables* tables_;
};

}  // namespace solidtex::pathtracer
