// Result of sampling a BSDF.
#pragma once

#include <glm/glm.hpp>

namespace solidtex::pathtracer {

constexpr float kDiffuseLobe = -1;  // in place of a GGX alpha

struct BsdfSample {
  glm::vec3 direction{0};
  glm::vec3 weight{0};         // BSDF times cosine divided by pdf
  float pdf = 0;               // 0: the sample is rejected
  float alpha = kDiffuseLobe;  // GGX alpha of the sampled lobe
  float ior = 1;               // far side over near side, if refracted
};

// Weights a direction sampled from one lobe by the density of all lobes (one-sample MIS).
template <class AnyBsdf>
BsdfSample weighed_sample(const AnyBsdf& bsdf, const glm::vec3& out, const glm::vec3& direction,
                          float alpha) {
  BsdfSample result{.direction = direction, .pdf = bsdf.pdf(out, direction), .alpha = alpha};
  if (result.pdf > 0) result.weight = bsdf.eval(out, direction) / result.pdf;
  return result;
}

}  // namespace solidtex::pathtracer
