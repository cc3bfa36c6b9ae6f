#include "plugins/pathtracer/materials/bsdf_coated.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "plugins/pathtracer/materials/microfacet.h"
#include "plugins/pathtracer/sampling/sampling.h"
#include "plugins/pathtracer/scene/color.h"

namespace solidtex::pathtracer {
namespace {

// Reflected fraction for one direction, by a stratified grid of visible normals.
float integrate_albedo(const glm::vec3& out, float alpha, float ior) {
  constexpr int kGrid = 32;
  float sum = 0;
  for (int i = 0; i < kGrid; ++i) {
    for (int j = 0; j < kGrid; ++j) {
      const glm::vec2 u((static_cast<float>(i) + 0.5f) / kGrid,
                        (static_cast<float>(j) + 0.5f) / kGrid);
      const glm::vec3 h = sample_visible_normal(out, alpha, u);
      const glm::vec3 in = glm::reflect(-out, h);
      if (in.z <= 0) continue;
      sum += fresnel_dielectric(glm::dot(out, h), ior) * masking_shadowing(out, in, alpha) /
             masking(out, alpha);
    }
  }
  return sum / (kGrid * kGrid);
}

}  // namespace

Coat::Coat(float roughness, float ior) : alpha_(alpha_of(roughness)), ior_(ior) {
  for (int i = 0; i < kEntries; ++i) {
    const float cosine = std::max(static_cast<float>(i) / (kEntries - 1), 1e-3f);
    table_[static_cast<std::size_t>(i)] =
        integrate_albedo(glm::vec3(std::sqrt(1 - cosine * cosine), 0, cosine), alpha_, ior_);
  }
  // 2 * integral of albedo(x) x dx, exact for the piecewise linear table.
  const float step = 1.0f / (kEntries - 1);
  for (int i = 0; i + 1 < kEntries; ++i) {
    const float x0 = static_cast<float>(i) * step, x1 = x0 + step;
    const float a = table_[static_cast<std::size_t>(i)],
                b = table_[static_cast<std::size_t>(i) + 1];
    average_ += step * (a * (2 * x0 + x1) + b * (x0 + 2 * x1)) / 3;
  }
}

Coat::Coat(const Coat& smoother, const Coat& rougher, float t, float roughness)
    : alpha_(alpha_of(roughness)),
      ior_(smoother.ior_),
      average_(smoother.average_ + t * (rougher.average_ - smoother.average_)) {
  for (std::size_t i = 0; i < table_.size(); ++i) {
    table_[i] = smoother.table_[i] + t * (rougher.table_[i] - smoother.table_[i]);
  }
}

float Coat::albedo(float cosine) const {
  const float x = std::clamp(cosine, 0.0f, 1.0f) * (kEntries - 1);
  const auto i = std::min(static_cast<std::size_t>(x), static_cast<std::size_t>(kEntries - 2));
  const float t = x - static_cast<float>(i);
  return table_[i] + t * (table_[i + 1] - table_[i]);
}

float Coat::internal_reflectance() const {
  // By reciprocity the flux through the interface is equal both ways; the solid angle inside is
  // smaller by the square of the index.
  return 1 - (1 - average_) / (ior_ * ior_);
}

glm::vec3 CoatedBsdf::eval(const glm::vec3& out, const glm::vec3& in) const {
  if (out.z <= 0 || in.z <= 0) return glm::vec3(0);
  if (!coat) return albedo * (in.z * glm::one_over_pi<float>());
  const glm::vec3 h = glm::normalize(out + in);
  const float specular = fresnel_dielectric(glm::dot(out, h), coat->ior()) * ggx(h, coat->alpha()) *
                         masking_shadowing(out, in, coat->alpha()) / (4 * out.z);
  // Interreflection between base and coat is a geometric series.
  const float r = coat->internal_reflectance();
  const glm::vec3 base = albedo * (1 - r) / (1.0f - albedo * r);
  const float transmitted = (1 - coat->albedo(out.z)) * (1 - coat->albedo(in.z)) /
                            (glm::pi<float>() * (1 - coat->average_albedo()));
  return base * (transmitted * in.z) + glm::vec3(specular);
}

float CoatedBsdf::coat_probability(float cosine) const {
  if (!coat) return 0;
  const float reflected = coat->albedo(cosine);
  const float below = (1 - reflected) * luminance(albedo);
  return std::clamp(reflected / (reflected + below), 0.1f, 0.9f);
}

float CoatedBsdf::pdf(const glm::vec3& out, const glm::vec3& in) const {
  if (out.z <= 0 || in.z <= 0) return 0;
  const float base = in.z * glm::one_over_pi<float>();
  if (!coat) return base;
  const float p = coat_probability(out.z);
  const glm::vec3 h = glm::normalize(out + in);
  return p * visible_reflection_density(out, h, coat->alpha()) + (1 - p) * base;
}

BsdfSample CoatedBsdf::sample(const glm::vec3& out, float lobe, const glm::vec2& u) const {
  if (out.z <= 0) return {};
  if (lobe < coat_probability(out.z)) {
    const glm::vec3 facet = sample_visible_normal(out, coat->alpha(), u);
    return weighed_sample(*this, out, glm::reflect(-out, facet), coat->alpha());
  }
  return weighed_sample(*this, out, sample_cosine_hemisphere(u), kDiffuseLobe);
}

}  // namespace solidtex::pathtracer
