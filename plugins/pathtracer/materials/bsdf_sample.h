// What sampling a BSDF gives.
#pragma once

#include <glm/glm.hpp>

namespace solidtex::pathtracer {

constexpr float kDiffuseLobe = -1;  // in place of a width of GGX

struct BsdfSample {
  glm::vec3 direction{0};
  glm::vec3 weight{0};         // BSDF times cosine over pdf
  float pdf = 0;               // 0: no light this way
  float alpha = kDiffuseLobe;  // GGX width of the lobe that chose the direction
  float ior = 1;               // of the far side over the near side, where the light was refracted
};

// A direction that one lobe chose, weighed by all lobes that could have.
template <class AnyBsdf>
BsdfSample weighed_sample(const AnyBsdf& bsdf, const glm::vec3& out, const glm::vec3& direction,
                          float alpha) {
  BsdfSample result{.direction = direction, .pdf = bsdf.pdf(out, direction), .alpha = alpha};
  if (result.pdf > 0) result.weight = bsdf.eval(out, direction) / result.pdf;
  return result;
}

}  // namespace solidtex::pathtracer
