#include "plugins/pathtracer/lights/environment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "plugins/pathtracer/sampling/angles.h"
#include "plugins/pathtracer/sampling/vectorized.h"
#include "plugins/pathtracer/scene/color.h"

namespace solidtex::pathtracer {
namespace {

std::size_t texel_index(int x, int y, int width) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
         static_cast<std::size_t>(x);
}

// Computes the latitude by atan2: an arc cosine is inexact near the poles.
SOLIDTEX_VECTORIZED void find_uv(int count, const float* x, const float* y, const float* z,
                                 float rotation, float* u, float* v) {
  for (int i = 0; i < padded_count(count); ++i) {
    const float turned = 0.5f - turns_of(z[i], x[i]) + rotation;
    u[i] = turned - std::floor(turned);
    v[i] = 2 * turns_of(y[i], std::sqrt(x[i] * x[i] + z[i] * z[i]));
  }
}

// One axis of bilinear look-ups. `from`: 0 to 1. `beyond`: the pixel whose center is the next after
// the position, 0 to size; `t`: its weight.
SOLIDTEX_VECTORIZED void find_pixels(int count, const float* from, float size, int* beyond,
                                     float* t) {
  for (int i = 0; i < padded_count(count); ++i) {
    const float x = (from[i] > 0 ? from[i] : 0) * size + 0.5f;  // 0 for NaN
    beyond[i] = static_cast<int>(x);
    t[i] = x - static_cast<float>(beyond[i]);
  }
}

// Computes directions from heights y on the unit sphere and u in the image.
SOLIDTEX_VECTORIZED void find_directions(int count, const float* u, float rotation, const float* y,
                                         float* x, float* z, float* v) {
  for (int i = 0; i < padded_count(count); ++i) {
    const float radius = std::sqrt(1 - y[i] * y[i]);
    const glm::vec2 place = unit_circle(0.5f + rotation - u[i]);
    x[i] = radius * place.y, z[i] = radius * place.x;
    v[i] = 2 * turns_of(y[i], radius);
  }
}

}  // namespace

CumulativeTable::CumulativeTable(std::span<const double> weights) {
  for (const double weight : weights) total_ += weight;
  double sum = 0;
  for (const double weight : weights) {
    sum += weight;
    entries_.push_back({static_cast<float>(total_ > 0 ? sum / total_ : 0), 0});
  }
  std::int32_t found = 0;
  const auto count = static_cast<std::int32_t>(entries_.size());
  for (std::int32_t step = 0; step < count; ++step) {
    const float target = static_cast<float>(step) / static_cast<float>(count);
    while (found + 1 < count && entries_[static_cast<std::size_t>(found)].sum <= target) ++found;
    entries_[static_cast<std::size_t>(step)].start = found;
  }
}

CumulativeTable::Interval CumulativeTable::sample(float u) const {
  const std::size_t last = entries_.size() - 1;
  auto i = static_cast<std::size_t>(entries_[step_of(u)].start);
  while (i > 0 && entries_[i - 1].sum > u) --i;  // rounding of the step
  while (i < last && entries_[i].sum <= u) ++i;
  const float start = i == 0 ? 0 : entries_[i - 1].sum;
  const float width = entries_[i].sum - start;
  const float fraction = width > 0 ? (u - start) / width : 0.5f;
  return {static_cast<int>(i), std::clamp(fraction, 0.0f, 0x1.fffffep-1f)};
}

Environment::Environment(const EnvironmentImage& description)
    : width_(description.image.width),
      height_(description.image.height),
      rotation_(description.rotation_degrees / 360) {
  for (const glm::vec3& pixel : description.image.pixels) texels_.emplace_back(pixel, 0);
  for (int row = 0; row <= height_; ++row) {
    heights_.push_back(
        std::cos(glm::pi<float>() * static_cast<float>(row) / static_cast<float>(height_)));
  }
  weigh_pixels();
}

// A batch, as structure of arrays.
struct Environment::Directions {
  alignas(64) float x[kBatchSize]{}, y[kBatchSize]{}, z[kBatchSize]{};
};

// Positions of a batch in the image: u and v from 0 to 1, and the neighboring pixels.
struct Environment::Places {
  alignas(64) float u[kBatchSize]{}, v[kBatchSize]{};
  alignas(64) int right[kBatchSize], bottom[kBatchSize];  // of the four neighboring pixels
  alignas(64) float tx[kBatchSize], ty[kBatchSize];       // their weights
};

// The weight is the mean bilinear reconstruction over the pixel, times its solid angle. Samples a
// quarter of a pixel from the corners are positive wherever the reconstruction is.
void Environment::weigh_pixels() {
  Places places;
  const auto mean_luminance = [&](int x, int y) {
    for (int i = 0; i < 4; ++i) {
      const float dx = i & 1 ? 0.75f : 0.25f, dy = i & 2 ? 0.75f : 0.25f;
      places.u[i] = (static_cast<float>(x) + dx) / static_cast<float>(width_);
      places.v[i] = (static_cast<float>(y) + dy) / static_cast<float>(height_);
    }
    EmittedLight corners[4];
    look_up(4, places, corners);
    float sum = 0;
    for (const EmittedLight& corner : corners) sum += luminance(corner.radiance);
    return sum / 4;
  };
  std::vector<double> rows;
  for (int y = 0; y < height_; ++y) {
    const auto row = static_cast<std::size_t>(y);
    const double band = static_cast<double>(heights_[row]) - static_cast<double>(heights_[row + 1]);
    std::vector<double> weights;
    for (int x = 0; x < width_; ++x) {
      float& weight = texels_[texel_index(x, y, width_)].w;
      weight = mean_luminance(x, y);
      weights.push_back(static_cast<double>(weight) * band);
    }
    rows.push_back(pixels_.emplace_back(weights).total());
  }
  rows_.emplace(rows);
  // The total is the sum of weight * band; a pixel's solid angle is band * 2 pi / width.
  density_per_weight_ =
      static_cast<float>(width_) / (static_cast<float>(rows_->total()) * glm::two_pi<float>());
}

double Environment::total_luminance() const {
  return rows_->total() * glm::two_pi<double>() / width_;
}

// u and v are from 0 to 1, so that wrapping needs no division. Prefetches all pixels first: they
// are scattered over an image larger than the cache.
void Environment::look_up(int count, Places& places, EmittedLight* lights) const {
  find_pixels(count, places.u, static_cast<float>(width_), places.right, places.tx);
  find_pixels(count, places.v, static_cast<float>(height_), places.bottom, places.ty);
  struct Corners {
    const float *upper_left, *upper_right, *lower_left, *lower_right;
  };
  std::array<Corners, kBatchSize> corners;
  for (int i = 0; i < count; ++i) {
    const int right = places.right[i], bottom = places.bottom[i];
    const int x0 = right > 0 ? right - 1 : width_ - 1, x1 = right < width_ ? right : 0;
    const glm::vec4* upper = &texels_[texel_index(0, std::max(bottom - 1, 0), width_)];
    const glm::vec4* lower = &texels_[texel_index(0, std::min(bottom, height_ - 1), width_)];
    __builtin_prefetch(upper + x0);
    __builtin_prefetch(lower + x0);
    corners[static_cast<std::size_t>(i)] = {&upper[x0].x, &upper[x1].x, &lower[x0].x, &lower[x1].x};
  }
  for (int i = 0; i < count; ++i) {
    const auto& [upper_left, upper_right, lower_left, lower_right] =
        corners[static_cast<std::size_t>(i)];
    const float tx = places.tx[i], ty = places.ty[i];
    float mixed[4];
    for (int c = 0; c < 4; ++c) {
      const float upper = upper_left[c] * (1 - tx) + upper_right[c] * tx;
      const float lower = lower_left[c] * (1 - tx) + lower_right[c] * tx;
      mixed[c] = upper * (1 - ty) + lower * ty;
    }
    // The nearest of the four is the pixel that contains the position.
    const float* nearest =
        ty < 0.5f ? (tx < 0.5f ? upper_left : upper_right) : (tx < 0.5f ? lower_left : lower_right);
    lights[i] = {{mixed[0], mixed[1], mixed[2]}, nearest[3] * density_per_weight_};
  }
}

void Environment::evaluate(std::span<const glm::vec3> directions,
                           std::span<EmittedLight> lights) const {
  Directions batch;
  Places places;
  for_each_batch(directions.size(), [&](std::size_t first, int count) {
    for (int i = 0; i < count; ++i) {
      const glm::vec3& direction = directions[first + static_cast<std::size_t>(i)];
      batch.x[i] = direction.x, batch.y[i] = direction.y, batch.z[i] = direction.z;
    }
    find_uv(count, batch.x, batch.y, batch.z, rotation_, places.u, places.v);
    look_up(count, places, &lights[first]);
  });
}

// Works step by step on the whole batch, so that memory accesses overlap.
void Environment::sample_batch(int count, const glm::vec2* u, Sample* samples) const {
  std::array<CumulativeTable::Interval, kBatchSize> rows;
  std::array<const glm::vec4*, kBatchSize> chosen;
  Directions directions;
  Places places;
  std::array<EmittedLight, kBatchSize> lights;
  for (int i = 0; i < count; ++i) {
    CumulativeTable::Interval& row = rows[static_cast<std::size_t>(i)];
    row = rows_->sample(u[i].y);
    pixels_[static_cast<std::size_t>(row.index)].prefetch(u[i].x);
  }
  for (int i = 0; i < count; ++i) {
    const CumulativeTable::Interval& row = rows[static_cast<std::size_t>(i)];
    const auto index = static_cast<std::size_t>(row.index);
    const CumulativeTable::Interval column = pixels_[index].sample(u[i].x);
    chosen[static_cast<std::size_t>(i)] = &texels_[texel_index(column.index, row.index, width_)];
    directions.y[i] = std::clamp(
        heights_[index] + row.fraction * (heights_[index + 1] - heights_[index]), -1.0f, 1.0f);
    places.u[i] = (static_cast<float>(column.index) + column.fraction) / static_cast<float>(width_);
  }
  find_directions(count, places.u, rotation_, directions.y, directions.x, directions.z, places.v);
  look_up(count, places, lights.data());
  for (int i = 0; i < count; ++i) {
    const auto index = static_cast<std::size_t>(i);
    samples[i] = {{directions.x[i], directions.y[i], directions.z[i]},
                  // The weight of the sampled pixel: rounding may move the look-up to a neighbor.
                  {lights[index].radiance, chosen[index]->w * density_per_weight_}};
  }
}

void Environment::sample(std::span<const glm::vec2> u, std::span<Sample> samples) const {
  for_each_batch(u.size(), [&](std::size_t first, int count) {
    sample_batch(count, &u[first], &samples[first]);
  });
}

}  // namespace solidtex::pathtracer
