#include "plugins/pathtracer/materials/bsdf_principled.h"

#include "plugins/pathtracer/materials/microfacet.h"
#include "plugins/pathtracer/sampling/sampling.h"
#include "plugins/pathtracer/scene/color.h"

namespace solidtex::pathtracer {
namespace {

// Relative lower bound of a lobe's probability, which bounds sample weights.
constexpr float kMinProbability = 0.05f;

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
  // A geometric series of bounces, each with Schlick's mean reflectance over the hemisphere.
  const glm::vec3 mean = p_.color + (1.0f - p_.color) / 21.0f;
  multiple_ = mean * mean * mirror_average_ / (1.0f - mean * (1 - mirror_average_));
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
    const float transmitted =
        (1 - interface_albedo(out.z)) * (1 - interface_albedo(in.z)) / (1 - interface_average_);
    const float reflected = p_.specular * fresnel_dielectric(cosine, tables_->ior) * facets;
    sum += (1 - p_.metallic) * (reflected + p_.color * (transmitted * lambert));
  }
  if (p_.metallic > 0) {
    const AlbedoTable& mirror = AlbedoTable::mirror();
    const float missing = (1 - mirror.at(p_.roughness, out.z)) *
                          (1 - mirror.at(p_.roughness, in.z)) /
                          std::max(1 - mirror_average_, 1e-6f);
    sum +=
        p_.metallic * (fresnel_metal(p_.color, cosine) * facets + multiple_ * (missing * lambert));
  }
  return sum;
}

glm::vec3 PrincipledBsdf::eval(const glm::vec3& out, const glm::vec3& in) const {
  if (out.z <= 0 || in.z <= 0) return glm::vec3(0);
  const glm::vec3 h = glm::normalize(out + in);
  const glm::vec3 body = base(out, in, h);
  if (p_.coat <= 0) return body;
  const float transmitted = 1 - std::max(coat_albedo(out.z), coat_albedo(in.z));
  const float coat = p_.coat * fresnel_dielectric(glm::dot(out, h), kCoatIor) *
                     facet_reflection(out, in, h, coat_alpha_);
  return body * transmitted + glm::vec3(coat);
}

PrincipledBsdf::LobeProbabilities PrincipledBsdf::lobe_probabilities(float cosine) const {
  const float coat = coat_albedo(cosine), interface = interface_albedo(cosine);
  const float mirror = p_.metallic > 0 ? AlbedoTable::mirror().at(p_.roughness, cosine) : 0;
  const float metal = p_.metallic * (1 - coat), body = (1 - p_.metallic) * (1 - coat);
  LobeProbabilities p{
      coat, body * interface + metal * mirror * luminance(fresnel_metal(p_.color, cosine)),
      body * (1 - interface) * luminance(p_.color) + metal * (1 - mirror) * luminance(multiple_)};
  const float min = kMinProbability * std::max(p.coat + p.interface + p.diffuse, 0.01f);
  if (p_.coat > 0) p.coat = std::max(p.coat, min);
  if (p_.metallic > 0 || p_.specular > 0) p.interface = std::max(p.interface, min);
  p.diffuse = std::max(p.diffuse, min);
  const float sum = p.coat + p.interface + p.diffuse;
  return {p.coat / sum, p.interface / sum, p.diffuse / sum};
}

float PrincipledBsdf::pdf(const glm::vec3& out, const glm::vec3& in) const {
  if (out.z <= 0 || in.z <= 0) return 0;
  const LobeProbabilities p = lobe_probabilities(out.z);
  const glm::vec3 h = glm::normalize(out + in);
  float density = p.diffuse * in.z * glm::one_over_pi<float>();
  if (p.interface > 0) density += p.interface * visible_reflection_density(out, h, alpha_);
  if (p.coat > 0) density += p.coat * visible_reflection_density(out, h, coat_alpha_);
  return density;
}

BsdfSample PrincipledBsdf::sample(const glm::vec3& out, float lobe, const glm::vec2& u) const {
  if (out.z <= 0) return {};
  const LobeProbabilities p = lobe_probabilities(out.z);
  if (lobe < p.coat + p.interface) {
    const float alpha = lobe < p.coat ? coat_alpha_ : alpha_;
    const glm::vec3 facet = sample_visible_normal(out, alpha, u);
    return weighed_sample(*this, out, glm::reflect(-out, facet), alpha);
  }
  return weighed_sample(*this, out, sample_cosine_hemisphere(u), kDiffuseLobe);
}

}  // namespace solidtex::pathtracer
