// BSDF of the material "dielectric": a rough refracting interface (Walter et al.,
// "Microfacet Models for Refraction through Rough Surfaces", 2007).
#pragma once

#include <glm/glm.hpp>

#include "plugins/pathtracer/materials/albedo_table.h"
#include "plugins/pathtracer/materials/bsdf_sample.h"

namespace solidtex::pathtracer {

// Diffuse lobes on both sides compensate the energy that single scattering loses (Kulla and Conty
// 2017), so that a clear interface conserves energy. Radiance refracted into the denser side grows
// by the square of the index.
class DielectricBsdf {
 public:
  class Tables {
   public:
    explicit Tables(float ior);

    float ior() const { return ior_; }
    // Single-scattering albedo seen from outside or inside.
    const AlbedoTable& albedo(bool inside) const { return albedo_[inside ? 1 : 0]; }
    // Transmitted fraction of multiply scattered light.
    float transmitted(bool inside, float roughness) const;

   private:
    float ior_;
    AlbedoTable albedo_[2];
    float smooth_[2];  // cosine-weighted mean transmittance of a smooth interface
  };

  // `color`: transmittance. Keeps a reference to `tables`.
  DielectricBsdf(const glm::vec3& color, float roughness, bool inside, const Tables& tables);

  glm::vec3 eval(const glm::vec3& out, const glm::vec3& in) const;
  float pdf(const glm::vec3& out, const glm::vec3& in) const;
  BsdfSample sample(const glm::vec3& out, float lobe, const glm::vec2& u) const;

 private:
  glm::vec3 half_vector(const glm::vec3& out, const glm::vec3& in) const;
  float refraction_jacobian(const glm::vec3& out, const glm::vec3& in, const glm::vec3& h) const;
  float missing(float cosine) const;  // energy that single scattering loses, from the viewer's side

  glm::vec3 color_;
  float roughness_, alpha_;
  bool inside_;
  float ior_;          // far side over near side
  float transmitted_;  // as Tables::transmitted
  const Tables* tables_;
};

}  // namespace solidtex::pathtracer
