#include "plugins/pathtracer/materials/bsdf_principled.h"

#include "plugins/pathtracer/materials/microfacet.h"
#include "plugins/pathtracer/sampling/sampling.h"

namespace solidtex::pathtracer {
namespace {

// Every lobe that is there gets some samples, so that none can be far brighter than its density.
constexpr float kLeastShare = 0.05f;

// Schlick's approximation of a metal's Fresnel reflectance.
glm::vec3 fresnel_metal(const glm::vec3& color, float cosine) {
  const float x = std::clamp(1 - cosine, 0.0f, 1.0f), x2 = x * x;
  return color + (1.0f - color) * (x2 * x2 * x);
}

}  // namespace

PrincipledBsdf::PrincipledBsdf(const Parameters& parameters, const Tables& tables)
    : p_(parameters), tables_(&tables) {
  p_.roughness = std::clamp(p_.roughness, kMinRoughness, kMaxRoughness);
  p_.coat_roughness = std::clamp(p_.coat_roughness, kMinRoughness, kMaxRoughness);
  alpha_ = alpha_of(p_.roughness);
  coat_alpha_ = alpha_of(p_.coat_roughness);
  interface_average_ = p_.specular * tables.interface.average(p_.roughness);
  mirror_average_ = AlbedoTable::mirror().average(p_.roughness);
  // A geometric series of bounces, each by the hemisphere's mean of Schlick's reflectance.
  const glm::vec3 mean = p_.color + (1.0f - p_.color) / 21.0f;
  many_ = mean * mean * mirror_average_ / (1.0f - mean * (1 - mirror_average_));
}

float PrincipledBsdf::coat_albedo(float cosine) const {
  return p_.coat > 0 ? p_.coat * tables_->coat.at(p_.coat_roughness, cosine) : 0;
}

float PrincipledBsdf::interface_albedo(float cosine) const {
  return p_.specular * tables_->interface.at(p_.roughness, cosine);
}

glm::vec3 PrincipledBsdf::base(const glm::vec3& out, const glm::vec3& in,
                               const glm::vec3& h) const {
  const float facets = facet_reflection(out, in, h, alpha_);
  const float cosine = glm::dot(out, h), lambert = in.z * glm::one_over_pi<float>();
  glm::vec3 sum(0);
  if (p_.metallic < 1) {
    const float through =
        (1 - interface_albedo(out.z)) * (1 - interface_albedo(in.z)) / (1 - interface_average_);
    const float reflected = p_.specular * fresnel_dielectric(cosine, tables_->ior) * facets;
    sum += (1 - p_.metallic) * (reflected + p_.color * (through * lambert));
  }
  if (p_.metallic > 0) {
    const AlbedoTable& mirror = AlbedoTable::mirror();
    const float lost = (1 - mirror.at(p_.roughness, out.z)) * (1 - mirror.at(p_.roughness, in.z)) /
                       std::max(1 - mirror_average_, 1e-6f);
    sum += p_.metallic * (fresnel_metal(p_.color, cosine) * facets + many_ * (lost * lambert));
  }
  return sum;
}

glm::vec3 PrincipledBsdf::eval(const glm::vec3& out, const glm::vec3& in) const {
  if (out.z <= 0 || in.z <= 0) return glm::vec3(0);
  const glm::vec3 h = glm::normalize(out + in);
  const glm::vec3 body = base(out, in, h);
  if (p_.coat <= 0) return body;
  const float through = 1 - std::max(coat_albedo(out.z), coat_albedo(in.z));
  const float coat = p_.coat * fresnel_dielectric(glm::dot(out, h), kCoatIor) *
                     facet_reflection(out, in, h, coat_alpha_);
  return body * through + glm::vec3(coat);
}

PrincipledBsdf::Shares PrincipledBsdf::shares(float cosine) const {
  const float coat = coat_albedo(cosine), interface = interface_albedo(cosine);
  const float mirror = p_.metallic > 0 ? AlbedoTable::mirror().at(p_.roughness, cosine) : 0;
  const float metal = p_.metallic * (1 - coat), body = (1 - p_.metallic) * (1 - coat);
  Shares s{coat, body * interface + metal * mirror * luminance(fresnel_metal(p_.color, cosine)),
           body * (1 - interface) * luminance(p_.color) + metal * (1 - mirror) * luminance(many_)};
  const float least = kLeastShare * std::max(s.coat + s.interface + s.diffuse, 0.01f);
  if (p_.coat > 0) s.coat = std::max(s.coat, least);
  if (p_.metallic > 0 || p_.specular > 0) s.interface = std::max(s.interface, least);
  s.diffuse = std::max(s.diffuse, least);
  const float sum = s.coat + s.interface + s.diffuse;
  return {s.coat / sum, s.interface / sum, s.diffuse / sum};
}

float PrincipledBsdf::pdf(const glm::vec3& out, const glm::vec3& in) const {
  if (out.z <= 0 || in.z <= 0) return 0;
  const Shares s = shares(out.z);
  const glm::vec3 h = glm::normalize(out + in);
  float density = s.diffuse * in.z * glm::one_over_pi<float>();
  if (s.interface > 0) density += s.interface * visible_reflection_density(out, h, alpha_);
  if (s.coat > 0) density += s.coat * visible_reflection_density(out, h, coat_alpha_);
  return density;
}

BsdfSample PrincipledBsdf::sample(const glm::vec3& out, float lobe, const glm::vec2& u) const {
  if (out.z <= 0) return {};
  const Shares s = shares(out.z);
  if (lobe < s.coat + s.interface) {
    const float alpha = lobe < s.coat ? coat_alpha_ : alpha_;
    const glm::vec3 facet = sample_visible_normal(out, alpha, u);
    return weighed_sample(*this, out, glm::reflect(-out, facet), alpha);
  }
  return weighed_sample(*this, out, sample_cosine_hemisphere(u), kDiffuseLobe);
}

}  // namespace solidtex::pathtracer
