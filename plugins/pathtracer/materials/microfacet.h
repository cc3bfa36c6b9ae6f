// Microfacets: the GGX distribution with Smith masking (Walter et al., "Microfacet Models for
// Refraction through Rough Surfaces", 2007). Directions are in the local frame, whose z is the
// normal, and point away from the surface.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <glm/gtc/constants.hpp>

#include "plugins/pathtracer/sampling/angles.h"

namespace solidtex::pathtracer {

// GGX alpha of a perceptually uniform roughness.
inline float alpha_of(float roughness) { return roughness * roughness; }

// Density of facet normals, per solid angle and surface area.
inline float ggx(const glm::vec3& h, float alpha) {
  const float a2 = alpha * alpha;
  // Computes 1 - z^2 from x and y: the difference would cancel near the peak of a smooth surface.
  const float denominator = (h.x * h.x + h.y * h.y) + a2 * h.z * h.z;
  return a2 / (glm::pi<float>() * denominator * denominator);
}

// Smith's Lambda of GGX.
inline float smith_lambda(const glm::vec3& w, float alpha) {
  const float tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
  return 0.5f * (std::sqrt(1 + alpha * alpha * tan2) - 1);
}

// Fraction of the facets facing `w` that are visible from `w`.
inline float masking(const glm::vec3& w, float alpha) { return 1 / (1 + smith_lambda(w, alpha)); }

// Height-correlated masking and shadowing of two directions on one side.
inline float masking_shadowing(const glm::vec3& out, const glm::vec3& in, float alpha) {
  return 1 / (1 + smith_lambda(out, alpha) + smith_lambda(in, alpha));
}

// Samples a facet normal visible from `out`, with the density visible_normal_density: Dupuy and
// Benyoub, "Sampling Visible GGX Normals with Spherical Caps", 2023.
inline glm::vec3 sample_visible_normal(const glm::vec3& out, float alpha, const glm::vec2& u) {
  const glm::vec3 standard = glm::normalize(glm::vec3(out.x * alpha, out.y * alpha, out.z));
  const float z = (1 - u.y) * (1 + standard.z) - standard.z;
  const float radius = std::sqrt(std::clamp(1 - z * z, 0.0f, 1.0f));
  const glm::vec3 h = standard + glm::vec3(radius * unit_circle(u.x), z);
  return glm::normalize(glm::vec3(h.x * alpha, h.y * alpha, std::max(h.z, 1e-7f)));
}
inline float visible_normal_density(const glm::vec3& out, const glm::vec3& h, float alpha) {
  return masking(out, alpha) * ggx(h, alpha) * std::max(glm::dot(out, h), 0.0f) / out.z;
}

// Density of the reflection of `out` at a sampled visible normal.
inline float visible_reflection_density(const glm::vec3& out, const glm::vec3& h, float alpha) {
  return masking(out, alpha) * ggx(h, alpha) / (4 * out.z);
}

// BSDF, times the cosine of `in`, of perfectly reflecting facets.
inline float facet_reflection(const glm::vec3& out, const glm::vec3& in, const glm::vec3& h,
                              float alpha) {
  return ggx(h, alpha) * masking_shadowing(out, in, alpha) / (4 * out.z);
}

// Fresnel reflectance of unpolarized light. `ior` is far side over near side; below one there is
// total internal reflection.
inline float fresnel_dielectric(float cosine, float ior) {
  cosine = std::clamp(cosine, 0.0f, 1.0f);
  const float inner2 = 1 - (1 - cosine * cosine) / (ior * ior);
  if (inner2 <= 0) return 1;
  const float inner = std::sqrt(inner2);
  const float s = (cosine - ior * inner) / (cosine + ior * inner);
  const float p = (ior * cosine - inner) / (ior * cosine + inner);
  return 0.5f * (s * s + p * p);
}

}  // namespace solidtex::pathtracer
