// View transforms, and visualizations of AOVs.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <glm/glm.hpp>
#include <limits>
#include <solidtex/image.hpp>

#include "plugins/pathtracer/scene/color.h"

namespace solidtex::pathtracer {
namespace {

glm::vec3 saturate(const glm::vec3& color) { return glm::clamp(color, 0.0f, 1.0f); }

// Night blue (0), cyan, green, yellow, red (1), as display values.
glm::vec3 color_ramp(float t) {
  static const std::array<glm::vec3, 5> colors = {glm::vec3(0.05f, 0.03f, 0.3f),
                                                  {0, 0.55f, 0.9f},
                                                  {0.2f, 0.75f, 0.3f},
                                                  {1, 0.9f, 0.1f},
                                                  {0.9f, 0.1f, 0.1f}};
  const float place = std::clamp(t, 0.0f, 1.0f) * static_cast<float>(colors.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(place), colors.size() - 2);
  return glm::mix(colors[i], colors[i + 1], place - static_cast<float>(i));
}

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

// Six stops up and down from middle gray.
glm::vec3 false_color(const glm::vec3& light) {
  const float stops = std::log2(std::max(luminance(light), 1e-6f) / 0.18f);
  return color_ramp(0.5f + stops / 12);
}

glm::vec3 encode(glm::vec3 light, ViewTransform transform) {
  // A value that is not finite must not change the other channels.
  for (int c = 0; c < 3; ++c) light[c] = std::isfinite(light[c]) ? std::max(light[c], 0.0f) : 0;
  light = glm::min(light, 1e6f);
  switch (transform) {
    case ViewTransform::filmic:
      return linear_to_srgb(saturate(filmic(light)));
    case ViewTransform::aces:
      return linear_to_srgb(saturate(aces(light)));
    case ViewTransform::false_color:
      return false_color(light);
    case ViewTransform::srgb:
      break;
  }
  return linear_to_srgb(saturate(light));
}

constexpr float kTexcoordPeriod = 64;                       // texels
constexpr float kMinFootprint = 0.25f, kMaxFootprint = 64;  // texels, ends of the color ramp

struct Range {
  float low = std::numeric_limits<float>::infinity(), high = -low;

  float normalize(float value) const { return high > low ? (value - low) / (high - low) : 0; }
};

Range finite_range(const std::vector<float>& values) {
  Range range;
  for (const float value : values) {
    if (!std::isfinite(value)) continue;
    range.low = std::min(range.low, value);
    range.high = std::max(range.high, value);
  }
  return range;
}

template <class Color>
Image colorize(const AovImage& source, Aov aov, Color color) {
  const std::vector<float>& values = source.values(aov);
  const std::size_t channels = info(aov).channels.size();
  Image image{source.window.width(), source.window.height(), {}};
  image.rgb.reserve(3 * source.window.pixel_count());
  for (std::size_t i = 0; i < values.size(); i += channels) {
    const glm::vec3 rgb = saturate(color(&values[i]));
    image.rgb.insert(image.rgb.end(), {rgb.x, rgb.y, rgb.z});
  }
  return image;
}

template <class... Values>
std::string format(const char* pattern, Values... values) {
  char text[160];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

Visualization visualize_normal(const AovImage& image) {
  const auto color = [](const float* n) { return 0.5f + 0.5f * glm::vec3(n[0], n[1], n[2]); };
  return {colorize(image, Aov::normal, color), "x, y, z from -1 to 1 as red, green, blue"};
}

Visualization visualize_texcoord(const AovImage& image) {
  const auto color = [](const float* t) {
    return glm::fract(glm::vec3(t[0], t[1], t[2]) / kTexcoordPeriod);
  };
  return {colorize(image, Aov::texcoord, color),
          format("x, y, z as red, green, blue, repeating every %g texels", kTexcoordPeriod)};
}

Visualization visualize_position(const AovImage& image) {
  const Range range = finite_range(image.values(Aov::position));
  const auto color = [&](const float* p) {
    return glm::vec3(range.normalize(p[0]), range.normalize(p[1]), range.normalize(p[2]));
  };
  return {colorize(image, Aov::position, color),
          format("x, y, z from %g to %g as red, green, blue", range.low, range.high)};
}

// Near is white, the background black.
Visualization visualize_depth(const AovImage& image) {
  const Range range = finite_range(image.values(Aov::depth));
  const auto color = [&](const float* z) {
    return glm::vec3(std::isfinite(*z) ? 1 - 0.9f * range.normalize(*z) : 0);
  };
  return {colorize(image, Aov::depth, color),
          format("from %g (white) to %g (dark)", range.low, range.high)};
}

Visualization visualize_footprint(const AovImage& image) {
  const float stops = std::log2(kMaxFootprint / kMinFootprint);
  const auto color = [&](const float* radius) {
    if (!(*radius > 0)) return glm::vec3(0);
    return color_ramp(std::log2(*radius / kMinFootprint) / stops);
  };
  return {colorize(image, Aov::footprint, color),
          format("radii from %g (blue) to %g texels (red)", kMinFootprint, kMaxFootprint)};
}

// The mean over channels, as a color ramp from 0 to the image's maximum.
Visualization visualize_amount(const AovImage& image, Aov aov) {
  const std::size_t channels = info(aov).channels.size();
  const auto amount = [&](const float* values) {
    float sum = 0;
    for (std::size_t c = 0; c < channels; ++c) sum += values[c];
    return sum / static_cast<float>(channels);
  };
  const std::vector<float>& values = image.values(aov);
  float max = 0;
  for (std::size_t i = 0; i < values.size(); i += channels) {
    if (std::isfinite(amount(&values[i]))) max = std::max(max, amount(&values[i]));
  }
  const auto color = [&](const float* value) {
    return color_ramp(max > 0 ? amount(value) / max : 0);
  };
  return {colorize(image, aov, color), format("from 0 (blue) to %g (red)", max)};
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

Image to_display(const Image& light, const Display& display) {
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

Visualization visualize(const AovImage& image, Aov aov, const Display& display) {
  switch (aov) {
    case Aov::beauty:
      return {to_display(beauty(image), display), ""};
    case Aov::albedo:
      return {to_display({image.window.width(), image.window.height(), image.values(aov)}, {}), ""};
    case Aov::normal:
      return visualize_normal(image);
    case Aov::texcoord:
      return visualize_texcoord(image);
    case Aov::position:
      return visualize_position(image);
    case Aov::depth:
      return visualize_depth(image);
    case Aov::footprint:
      return visualize_footprint(image);
    case Aov::cost:
    case Aov::variance:
    case Aov::samples:
      break;
  }
  return visualize_amount(image, aov);
}

}  // namespace solidtex::pathtracer
