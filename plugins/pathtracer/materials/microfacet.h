// Rough interfaces: the GGX distribution of facets with Smith's masking (Walter et al., "Microfacet
// Models for Refraction through Rough Surfaces", 2007). Directions are in the local frame: z is the
// normal, and point away from the surface.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <glm/gtc/constants.hpp>

namespace solidtex::pathtracer {

// Alpha of GGX for a roughness, which is even to the eye.
inline float alpha_of(float roughness) { return roughness * roughness; }

// Density of facet normals, per solid angle and area of the surface.
inline float ggx(const glm::vec3& h, float alpha) {
  const float a2 = alpha * alpha;
  // 1 - z^2 from x and y: the difference would cancel near the peak of a smooth surface.
  const float denominator = (h.x * h.x + h.y * h.y) + a2 * h.z * h.z;
  return a2 / (glm::pi<float>() * denominator * denominator);
}

// Smith's Lambda of GGX.
inline float smith_lambda(const glm::vec3& w, float alpha) {
  const float tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
  return 0.5f * (std::sqrt(1 + alpha * alpha * tan2) - 1);
}

// Share of the facets facing `w` that it sees.
inline float masking(const glm::vec3& w, float alpha) { return 1 / (1 + smith_lambda(w, alpha)); }

// The same for two directions on one side, which see what is high rather than what is low.
inline float masking_shadowing(const glm::vec3& out, const glm::vec3& in, float alpha) {
  return 1 / (1 + smith_lambda(out, alpha) + smith_lambda(in, alpha));
}

// A facet's normal as visible from `out`: Dupuy and Benyoub, "Sampling Visible GGX Normals with
// Spherical Caps", 2023. Its density is that of visible_normal_density.
glm::vec3 sample_visible_normal(const glm::vec3& out, float alpha, const glm::vec2& u);
inline float visible_normal_density(const glm::vec3& out, const glm::vec3& h, float alpha) {
  return masking(out, alpha) * ggx(h, alpha) * std::max(glm::dot(out, h), 0.0f) / out.z;
}

// Density of the direction that a facet chosen so reflects `out` into.
inline float visible_reflection_density(const glm::vec3& out, const glm::vec3& h, float alpha) {
  return masking(out, alpha) * ggx(h, alpha) / (4 * out.z);
}

// BSDF times cosine of `in` of facets that reflect all light.
inline float facet_reflection(const glm::vec3& out, const glm::vec3& in, const glm::vec3& h,
                              float alpha) {
  return ggx(h, alpha) * masking_shadowing(out, in, alpha) / (4 * out.z);
}

// Fresnel reflectance of unpolarised light; `ior` is that of the far side over that of the near
// one, and may be below one (total internal reflection).
float fresnel_dielectric(float cosine, float ior);

}  // namespace solidtex::pathtracer
