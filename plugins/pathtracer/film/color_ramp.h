// Numbers as colours.
#pragma once

#include <algorithm>
#include <array>
#include <glm/glm.hpp>

namespace solidtex::pathtracer {

// From night blue (0) over cyan, green and yellow to red (1), encoded for a screen.
inline glm::vec3 color_ramp(float t) {
  static const std::array<glm::vec3, 5> colors = {glm::vec3(0.05f, 0.03f, 0.3f),
                                                  {0, 0.55f, 0.9f},
                                                  {0.2f, 0.75f, 0.3f},
                                                  {1, 0.9f, 0.1f},
                                                  {0.9f, 0.1f, 0.1f}};
  const float place = std::clamp(t, 0.0f, 1.0f) * static_cast<float>(colors.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(place), colors.size() - 2);
  return glm::mix(colors[i], colors[i + 1], place - static_cast<float>(i));
}

}  // namespace solidtex::pathtracer
