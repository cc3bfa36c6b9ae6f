// Layers as pictures to look at.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/glm.hpp>
#include <limits>
#include <solidtex/picture.hpp>

#include "plugins/pathtracer/film/color_ramp.h"

namespace solidtex::pathtracer {
namespace {

constexpr float kPeriod = 64;                     // texels, of the colours of `texcoord`
constexpr float kFinest = 0.25f, kCoarsest = 64;  // texels, of those of `footprint`

struct Range {
  float low = std::numeric_limits<float>::infinity(), high = -low;

  float place(float value) const { return high > low ? (value - low) / (high - low) : 0; }
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
Image image_of(const Picture& picture, Layer layer, Color color) {
  const std::vector<float>& values = picture.values(layer);
  const std::size_t channels = info(layer).channels.size();
  Image image{picture.window.width(), picture.window.height(), {}};
  image.rgb.reserve(3 * picture.window.pixel_count());
  for (std::size_t i = 0; i < values.size(); i += channels) {
    const glm::vec3 rgb = glm::clamp(color(&values[i]), 0.0f, 1.0f);
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

View show_normal(const Picture& picture) {
  const auto color = [](const float* n) { return 0.5f + 0.5f * glm::vec3(n[0], n[1], n[2]); };
  return {image_of(picture, Layer::normal, color), "x, y, z from -1 to 1 as red, green, blue"};
}

View show_texcoord(const Picture& picture) {
  const auto color = [](const float* t) {
    return glm::fract(glm::vec3(t[0], t[1], t[2]) / kPeriod);
  };
  return {image_of(picture, Layer::texcoord, color),
          format("x, y, z as red, green, blue, again and again every %g texels", kPeriod)};
}

View show_position(const Picture& picture) {
  const Range range = finite_range(picture.values(Layer::position));
  const auto color = [&](const float* p) {
    return glm::vec3(range.place(p[0]), range.place(p[1]), range.place(p[2]));
  };
  return {image_of(picture, Layer::position, color),
          format("x, y, z from %g to %g as red, green, blue", range.low, range.high)};
}

// Near is white; what is not there is black.
View show_depth(const Picture& picture) {
  const Range range = finite_range(picture.values(Layer::depth));
  const auto color = [&](const float* z) {
    return glm::vec3(std::isfinite(*z) ? 1 - 0.9f * range.place(*z) : 0);
  };
  return {image_of(picture, Layer::depth, color),
          format("from %g (white) to %g (dark)", range.low, range.high)};
}

View show_footprint(const Picture& picture) {
  const float stops = std::log2(kCoarsest / kFinest);
  const auto color = [&](const float* radius) {
    if (!(*radius > 0)) return glm::vec3(0);
    return color_ramp(std::log2(*radius / kFinest) / stops);
  };
  return {image_of(picture, Layer::footprint, color),
          format("radii from %g (blue) to %g texels (red)", kFinest, kCoarsest)};
}

// From 0, blue, to the largest of the picture, red; of colours their mean.
View show_amount(const Picture& picture, Layer layer) {
  const std::size_t channels = info(layer).channels.size();
  const auto amount = [&](const float* values) {
    float sum = 0;
    for (std::size_t c = 0; c < channels; ++c) sum += values[c];
    return sum / static_cast<float>(channels);
  };
  const std::vector<float>& values = picture.values(layer);
  float largest = 0;
  for (std::size_t i = 0; i < values.size(); i += channels) {
    if (std::isfinite(amount(&values[i]))) largest = std::max(largest, amount(&values[i]));
  }
  const auto color = [&](const float* value) {
    return color_ramp(largest > 0 ? amount(value) / largest : 0);
  };
  return {image_of(picture, layer, color), format("from 0 (blue) to %g (red)", largest)};
}

}  // namespace

View show(const Picture& picture, Layer layer, const Display& display) {
  switch (layer) {
    case Layer::beauty:
      return {show(beauty_of(picture), display), ""};
    case Layer::albedo:
      return {show(Image{picture.window.width(), picture.window.height(), picture.values(layer)},
                   Display{}),
              ""};
    case Layer::normal:
      return show_normal(picture);
    case Layer::texcoord:
      return show_texcoord(picture);
    case Layer::position:
      return show_position(picture);
    case Layer::depth:
      return show_depth(picture);
    case Layer::footprint:
      return show_footprint(picture);
    case Layer::cost:
    case Layer::variance:
    case Layer::samples:
      break;
  }
  return show_amount(picture, layer);
}

}  // namespace solidtex::pathtracer
