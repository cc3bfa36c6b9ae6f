#include "plugins/pathtracer/materials/bsdf_dielectric.h"

#include <algorithm>
#include <cmath>

#include "plugins/pathtracer/materials/microfacet.h"
#include "plugins/pathtracer/sampling/sampling.h"

namespace solidtex::pathtracer {
namespace {

// Cosine-weighted mean transmittance of a smooth interface.
float mean_transmittance(float ior) {
  constexpr int kSteps = 4096;
  float sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const float cosine = std::sqrt((static_cast<float>(i) + 0.5f) / kSteps);
    sum += 1 - fresnel_dielectric(cosine, ior);
  }
  return sum / kSteps;
}

}  // namespace

DielectricBsdf::Tables::Tables(float ior)
    : ior_(ior),
      albedo_{AlbedoTable::reflection_and_refraction(ior),
              AlbedoTable::reflection_and_refraction(1 / ior)},
      smooth_{mean_transmittance(ior), mean_transmittance(1 / ior)} {}

// Reciprocity requires that transmitted * missing is n^2 times larger outside, as is smooth_. So
// transmitted = a * smooth_ / missing, with the largest a that keeps it at or below smooth_.
float DielectricBsdf::Tables::transmitted(bool inside, float roughness) const {
  const float missing[2] = {std::max(1 - albedo_[0].average(roughness), 1e-6f),
                            std::max(1 - albedo_[1].average(roughness), 1e-6f)};
  const int side = inside ? 1 : 0;
  return std::min(missing[0], missing[1]) * smooth_[side] / missing[side];
}

DielectricBsdf::DielectricBsdf(const glm::vec3& color, float roughness, bool inside,
                               const Tables& tables)
    : color_(color),
      roughness_(std::clamp(roughness, kMinRoughness, kMaxRoughness)),
      alpha_(alpha_of(roughness_)),
      inside_(inside),
      ior_(inside ? 1 / tables.ior() : tables.ior()),
      transmitted_(tables.transmitted(inside, roughness_)),
      tables_(&tables) {}

// Normal of the facet that scatters `in` to `out`, on the viewer's side.
glm::vec3 DielectricBsdf::half_vector(const glm::vec3& out, const glm::vec3& in) const {
  const glm::vec3 h = in.z > 0 ? out + in : out + ior_ * in;
  return glm::normalize(h.z < 0 ? -h : h);
}

// Jacobian from facet normals to refracted directions.
float DielectricBsdf::refraction_jacobian(const glm::vec3& out, const glm::vec3& in,
                                          const glm::vec3& h) const {
  const float cosine = glm::dot(in, h), sum = glm::dot(out, h) + ior_ * cosine;
  return ior_ * ior_ * std::abs(cosine) / (sum * sum);
}

float DielectricBsdf::missing(float cosine) const {
  return 1 - tables_->albedo(inside_).at(roughness_, cosine);
}

glm::vec3 DielectricBsdf::eval(const glm::vec3& out, const glm::vec3& in) const {
  if (out.z <= 0 || in.z == 0) return glm::vec3(0);
  const glm::vec3 h = half_vector(out, in);
  const float fresnel = fresnel_dielectric(glm::dot(out, h), ior_);
  const bool far = in.z < 0;
  const AlbedoTable& arriving = tables_->albedo(far ? !inside_ : inside_);
  const float missing_in = 1 - arriving.at(roughness_, std::abs(in.z));
  const float mean_missing = std::max(1 - arriving.average(roughness_), 1e-6f);
  const float multiple =
      missing(out.z) * missing_in / mean_missing * std::abs(in.z) * glm::one_over_pi<float>();
  if (!far) {
    const float single = fresnel * facet_reflection(out, in, h, alpha_);
    return glm::vec3(single + (1 - transmitted_) * multiple);
  }
  float single = 0;
  if (glm::dot(out, h) > 0 && glm::dot(in, h) < 0) {
    single = (1 - fresnel) * visible_normal_density(out, h, alpha_) * masking(in, alpha_) *
             refraction_jacobian(out, in, h);
  }
  return color_ * ((single + transmitted_ * multiple) / (ior_ * ior_));
}

float DielectricBsdf::pdf(const glm::vec3& out, const glm::vec3& in) const {
  if (out.z <= 0 || in.z == 0) return 0;
  const glm::vec3 h = half_vector(out, in);
  const float fresnel = fresnel_dielectric(glm::dot(out, h), ior_);
  const float multiple = missing(out.z),
              diffuse = multiple * std::abs(in.z) * glm::one_over_pi<float>();
  if (in.z > 0) {
    return (1 - multiple) * fresnel * visible_reflection_density(out, h, alpha_) +
           diffuse * (1 - transmitted_);
  }
  float single = 0;
  if (glm::dot(out, h) > 0 && glm::dot(in, h) < 0) {
    single = (1 - multiple) * (1 - fresnel) * visible_normal_density(out, h, alpha_) *
             refraction_jacobian(out, in, h);
  }
  return single + diffuse * transmitted_;
}

BsdfSample DielectricBsdf::sample(const glm::vec3& out, float lobe, const glm::vec2& u) const {
  if (out.z <= 0) return {};
  glm::vec3 direction;
  float alpha = kDiffuseLobe;
  const float multiple = missing(out.z);
  if (lobe < multiple) {
    const glm::vec3 up = sample_cosine_hemisphere(u);
    direction = lobe < multiple * transmitted_ ? -up : up;
  } else {
    alpha = alpha_;
    const glm::vec3 h = sample_visible_normal(out, alpha_, u);
    const bool reflected =
        (lobe - multiple) / (1 - multiple) < fresnel_dielectric(glm::dot(out, h), ior_);
    direction = reflected ? glm::reflect(-out, h) : glm::refract(-out, h, 1 / ior_);
    if (reflected != (direction.z > 0)) return {};  // blocked by a neighboring facet
  }
  BsdfSample result = weighed_sample(*this, out, direction, alpha);
  if (direction.z < 0) result.ior = ior_;
  return result;
}

}  // namespace solidtex::pathtracer
