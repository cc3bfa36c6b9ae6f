// What sampling a BSDF gives.
#pragma once

#include <glm/glm.hpp>

namespace solidtex::pathtracer {

struct BsdfSample {
  glm::vec3 direction{0};
  glm::vec3 weight{0};  // BSDF times cosine over pdf
  float pdf = 0;        // 0: no light this way
  float alpha = -1;     // GGX width of the lobe that chose the direction; below 0: a diffuse one
  float ior = 1;        // of the far side over the near side, where the light was refracted
};

}  // namespace solidtex::pathtracer
