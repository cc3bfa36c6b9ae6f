#include "plugins/pathtracer/materials/microfacet.h"

#include "plugins/pathtracer/sampling/angles.h"

namespace solidtex::pathtracer {

glm::vec3 sample_visible_normal(const glm::vec3& out, float alpha, const glm::vec2& u) {
  const glm::vec3 standard = glm::normalize(glm::vec3(out.x * alpha, out.y * alpha, out.z));
  const float z = (1 - u.y) * (1 + standard.z) - standard.z;
  const float radius = std::sqrt(std::clamp(1 - z * z, 0.0f, 1.0f));
  const glm::vec3 h = standard + glm::vec3(radius * unit_circle(u.x), z);
  return glm::normalize(glm::vec3(h.x * alpha, h.y * alpha, std::max(h.z, 1e-7f)));
}

float fresnel_dielectric(float cosine, float ior) {
  cosine = std::clamp(cosine, 0.0f, 1.0f);
  const float inner2 = 1 - (1 - cosine * cosine) / (ior * ior);
  if (inner2 <= 0) return 1;
  const float inner = std::sqrt(inner2);
  const float s = (cosine - ior * inner) / (cosine + ior * inner);
  const float p = (ior * cosine - inner) / (ior * cosine + inner);
  return 0.5f * (s * s + p * p);
}

}  // namespace solidtex::pathtracer
