#include "plugins/pathtracer/environment.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "plugins/pathtracer/sampling.h"

namespace solidtex::pathtracer {
namespace {

// Height y of the upper edge of a row on the unit sphere.
float row_height(int row, int row_count) {
  return std::cos(glm::pi<float>() * static_cast<float>(row) / static_cast<float>(row_count));
}

// Finds the interval of a cumulative table that u falls into, and how far (0 to 1) into it.
struct Interval {
  int index;
  float fraction;
};
Interval find_interval(std::span<const double> sums, float u) {
  const double target = static_cast<double>(u) * sums.back();
  const auto found = std::upper_bound(sums.begin(), sums.end(), target);
  auto i = static_cast<std::size_t>(std::min(found, sums.end() - 1) - sums.begin());
  const double start = i == 0 ? 0 : sums[i - 1];
  const double fraction = sums[i] > start ? (target - start) / (sums[i] - start) : 0.5;
  return {static_cast<int>(i), std::clamp(static_cast<float>(fraction), 0.0f, 0x1.fffffep-1f)};
}

}  // namespace

Environment::Environment(const EnvironmentImage& description)
    : image_(description.image), rotation_(description.rotation_degrees / 360) {
  const int width = image_.width, height = image_.height;
  double total = 0;
  for (int y = 0; y < height; ++y) {
    const float band = row_height(y, height) - row_height(y + 1, height);
    double row = 0;
    for (int x = 0; x < width; ++x) {
      weights_.push_back(mean_luminance(x, y));
      row += static_cast<double>(weights_.back()) * band;
      pixel_sums_.push_back(row);
    }
    total += row;
    row_sums_.push_back(total);
  }
}

// Mean over the pixel of its bilinear reconstruction (a quarter of the way into the neighbours is
// enough to be positive wherever the reconstruction is).
float Environment::mean_luminance(int x, int y) const {
  float sum = 0;
  for (const float dy : {0.25f, 0.75f}) {
    for (const float dx : {0.25f, 0.75f}) {
      sum += luminance(lookup((static_cast<float>(x) + dx) / static_cast<float>(image_.width),
                              (static_cast<float>(y) + dy) / static_cast<float>(image_.height)));
    }
  }
  return sum / 4;
}

glm::vec2 Environment::to_uv(const glm::vec3& direction) const {
  const float longitude = std::atan2(direction.x, direction.z) / glm::two_pi<float>();
  const float u = 0.5f - longitude + rotation_;
  const float v = std::acos(std::clamp(direction.y, -1.0f, 1.0f)) / glm::pi<float>();
  return {u - std::floor(u), v};
}

glm::vec3 Environment::lookup(float u, float v) const {
  const float x = u * static_cast<float>(image_.width) - 0.5f;
  const float y = v * static_cast<float>(image_.height) - 0.5f;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const float tx = x - static_cast<float>(x0), ty = y - static_cast<float>(y0);
  const auto pixel = [&](int px, int py) {
    return image_.at((px + image_.width) % image_.width, std::clamp(py, 0, image_.height - 1));
  };
  return glm::mix(glm::mix(pixel(x0, y0), pixel(x0 + 1, y0), tx),
                  glm::mix(pixel(x0, y0 + 1), pixel(x0 + 1, y0 + 1), tx), ty);
}

glm::vec3 Environment::radiance(const glm::vec3& direction) const {
  const glm::vec2 uv = to_uv(direction);
  return lookup(uv.x, uv.y);
}

float Environment::density(int x, int y) const {
  const auto index = static_cast<std::size_t>(y) * static_cast<std::size_t>(image_.width) +
                     static_cast<std::size_t>(x);
  // total = sum of weight * band over pixels; a pixel's solid angle is band * 2 pi / width.
  return weights_[index] * static_cast<float>(image_.width) /
         (static_cast<float>(row_sums_.back()) * glm::two_pi<float>());
}

DirectionSample Environment::sample(const glm::vec2& u) const {
  const Interval row = find_interval(row_sums_, u.y);
  const auto width = static_cast<std::size_t>(image_.width);
  const Interval column = find_interval(
      std::span(pixel_sums_).subspan(static_cast<std::size_t>(row.index) * width, width), u.x);
  const float top = row_height(row.index, image_.height);
  const float bottom = row_height(row.index + 1, image_.height);
  const float y = std::clamp(top + row.fraction * (bottom - top), -1.0f, 1.0f);
  const float column_u =
      (static_cast<float>(column.index) + column.fraction) / static_cast<float>(image_.width);
  const float longitude = glm::two_pi<float>() * (0.5f + rotation_ - column_u);
  const float radius = std::sqrt(std::max(0.0f, 1 - y * y));
  return {{radius * std::sin(longitude), y, radius * std::cos(longitude)},
          density(column.index, row.index)};
}

float Environment::pdf(const glm::vec3& direction) const {
  const glm::vec2 uv = to_uv(direction);
  const auto index = [](float t, int count) {
    return std::clamp(static_cast<int>(t * static_cast<float>(count)), 0, count - 1);
  };
  return density(index(uv.x, image_.width), index(uv.y, image_.height));
}

}  // namespace solidtex::pathtracer
