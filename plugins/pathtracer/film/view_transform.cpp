// From light to screen values.
#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

#include "plugins/pathtracer/film/color_ramp.h"
#include "plugins/pathtracer/materials/textures.h"
#include "plugins/pathtracer/sampling/sampling.h"

namespace solidtex::pathtracer {
namespace {

glm::vec3 clamped(const glm::vec3& color) { return glm::clamp(color, 0.0f, 1.0f); }

// John Hable, "Uncharted 2: HDR Lighting", GDC 2010: shoulder, linear part and toe of a film.
glm::vec3 hable_curve(const glm::vec3& x) {
  constexpr float A = 0.15f, B = 0.50f, C = 0.10f, D = 0.20f, E = 0.02f, F = 0.30f;
  return (x * (A * x + C * B) + D * E) / (x * (A * x + B) + D * F) - E / F;
}

glm::vec3 filmic(const glm::vec3& light) {
  constexpr float white = 11.2f, exposure_bias = 2;  // both from the talk
  return hable_curve(exposure_bias * light) / hable_curve(glm::vec3(white));
}

// Krzysztof Narkowicz, "ACES Filmic Tone Mapping Curve", 2015.
glm::vec3 aces(const glm::vec3& x) {
  return (x * (2.51f * x + 0.03f)) / (x * (2.43f * x + 0.59f) + 0.14f);
}

// Six stops up and down from middle grey.
glm::vec3 false_color(const glm::vec3& light) {
  const float stops = std::log2(std::max(luminance(light), 1e-6f) / 0.18f);
  return color_ramp(0.5f + stops / 12);
}

glm::vec3 encode(glm::vec3 light, ViewTransform transform) {
  // No eye sees what is not finite, but it must not decide about its neighbours.
  for (int c = 0; c < 3; ++c) light[c] = std::isfinite(light[c]) ? std::max(light[c], 0.0f) : 0;
  light = glm::min(light, 1e6f);
  switch (transform) {
    case ViewTransform::filmic:
      return linear_to_srgb(clamped(filmic(light)));
    case ViewTransform::aces:
      return linear_to_srgb(clamped(aces(light)));
    case ViewTransform::false_color:
      return false_color(light);
    case ViewTransform::srgb:
      break;
  }
  return linear_to_srgb(clamped(light));
}

}  // namespace

const std::map<std::string, ViewTransform>& view_transforms() {
  static const std::map<std::string, ViewTransform> names = {
      {"srgb", ViewTransform::srgb},
      {"filmic", ViewTransform::filmic},
      {"aces", ViewTransform::aces},
      {"false-color", ViewTransform::false_color}};
  return names;
}

Image show(const Image& light, const Display& display) {
  const float factor = std::exp2(display.exposure);
  Image result{light.width, light.height, {}};
  result.rgb.reserve(light.rgb.size());
  for (std::size_t i = 0; i < light.rgb.size(); i += 3) {
    const glm::vec3 color(light.rgb[i], light.rgb[i + 1], light.rgb[i + 2]);
    const glm::vec3 encoded = encode(factor * color, display.transform);
    result.rgb.insert(result.rgb.end(), {encoded.x, encoded.y, encoded.z});
  }
  return result;
}

}  // namespace solidtex::pathtracer
