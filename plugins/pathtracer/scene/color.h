// Linear RGB colors.
#pragma once

#include <glm/glm.hpp>

#include "plugins/common/srgb.h"

namespace solidtex::pathtracer {

inline glm::vec3 srgb_to_linear(const glm::vec3& c) {
  return {solidtex::srgb_to_linear(c.x), solidtex::srgb_to_linear(c.y),
          solidtex::srgb_to_linear(c.z)};
}
inline glm::vec3 linear_to_srgb(const glm::vec3& c) {
  return {solidtex::linear_to_srgb(c.x), solidtex::linear_to_srgb(c.y),
          solidtex::linear_to_srgb(c.z)};
}

inline float luminance(const glm::vec3& color) {
  return glm::dot(color, glm::vec3(0.2126f, 0.7152f, 0.0722f));
}

}  // namespace solidtex::pathtracer
