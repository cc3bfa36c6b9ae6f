#include "plugins/pathtracer/film/framebuffer.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace solidtex::pathtracer {
namespace {

constexpr double kMinMean = 0.01;  // keeps the relative error of dark blocks finite

}  // namespace

Framebuffer::Framebuffer(const Window& window, const AovSet& aovs, bool estimates_noise)
    : window_(window), aovs_(aovs) {
  AovSet summed = aovs;
  if (estimates_noise) summed.add(Aov::variance);
  if (summed.has(Aov::variance)) summed.add(Aov::beauty);
  const std::size_t pixels = window.pixel_count();
  counts_.resize(pixels);
  if (aovs.has_any({Aov::depth, Aov::position})) hits_.resize(pixels);
  if (aovs.has_any({Aov::texcoord, Aov::footprint})) textured_.resize(pixels);
  for (const AovInfo& aov : all_aovs()) {
    if (summed.has(aov.aov) && aov.aov != Aov::samples) {
      sums(aov.aov).resize(pixels * aov.channels.size());
    }
  }
}

void Framebuffer::add(Aov aov, std::size_t pixel, const glm::vec3& value) {
  if (sums(aov).empty()) return;
  for (int c = 0; c < 3; ++c) sums(aov)[3 * pixel + static_cast<std::size_t>(c)] += value[c];
}

void Framebuffer::add_radiance(std::size_t pixel, const glm::vec3& radiance) {
  add(Aov::beauty, pixel, radiance);
  if (sums(Aov::variance).empty()) return;
  for (int c = 0; c < 3; ++c) {
    const double value = radiance[c];
    sums(Aov::variance)[3 * pixel + static_cast<std::size_t>(c)] += value * value;
  }
}

void Framebuffer::add_first_hit(std::size_t pixel, const FirstHit& hit) {
  add(Aov::albedo, pixel, hit.albedo);
  add(Aov::normal, pixel, hit.normal);
  add(Aov::position, pixel, hit.position);
  add(Aov::texcoord, pixel, hit.texcoord);
  if (!sums(Aov::depth).empty()) sums(Aov::depth)[pixel] += hit.depth;
  if (!sums(Aov::footprint).empty()) sums(Aov::footprint)[pixel] += hit.footprint;
  if (!hits_.empty()) hits_[pixel] += hit.is_object;
  if (!textured_.empty()) textured_[pixel] += hit.is_textured;
}

void Framebuffer::add_cost(std::size_t pixel, std::uint32_t points) {
  sums(Aov::cost)[pixel] += points;
}

double Framebuffer::variance_of_mean(std::size_t pixel, std::size_t channel) const {
  const double n = counts_[pixel];
  if (n < 2) return std::numeric_limits<double>::infinity();
  const double sum = sums(Aov::beauty)[3 * pixel + channel];
  const double squares = sums(Aov::variance)[3 * pixel + channel];
  return std::max(0.0, squares - sum * sum / n) / ((n - 1) * n);
}

double Framebuffer::relative_error(const Window& block) const {
  double variance = 0, mean = 0;
  for (int y = block.y0; y < block.y1; ++y) {
    for (std::size_t i = pixel(block.x0, y); i < pixel(block.x1, y); ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        variance += variance_of_mean(i, c);
        mean += sums(Aov::beauty)[3 * i + c] / counts_[i];
      }
    }
  }
  const double values = 3 * static_cast<double>(block.pixel_count());
  return std::sqrt(variance / values) / std::max(mean / values, kMinMean);
}

float Framebuffer::mean(Aov aov, std::size_t pixel, std::size_t channel) const {
  if (aov == Aov::samples) return static_cast<float>(counts_[pixel]);
  if (aov == Aov::variance) return static_cast<float>(variance_of_mean(pixel, channel));
  const std::size_t channels = info(aov).channels.size();
  std::uint32_t count = counts_[pixel];
  if (aov == Aov::depth || aov == Aov::position) count = hits_[pixel];
  if (aov == Aov::texcoord || aov == Aov::footprint) count = textured_[pixel];
  if (count == 0) return aov == Aov::depth ? std::numeric_limits<float>::infinity() : 0.0f;
  return static_cast<float>(sums(aov)[channels * pixel + channel] / count);
}

std::vector<std::span<std::byte>> Framebuffer::arrays() {
  std::vector<std::span<std::byte>> result;
  for (auto* values : {&counts_, &hits_, &textured_}) {
    result.push_back(std::as_writable_bytes(std::span(*values)));
  }
  for (auto& values : sums_) result.push_back(std::as_writable_bytes(std::span(values)));
  return result;
}

AovImage Framebuffer::image(int width, int height, const Window& crop) const {
  AovImage result{width, height, crop, {}};
  for (const auto& [aov, name, channels] : all_aovs()) {
    if (!aovs_.has(aov)) continue;
    std::vector<float> values;
    values.reserve(crop.pixel_count() * channels.size());
    for (int y = crop.y0; y < crop.y1; ++y) {
      for (int x = crop.x0; x < crop.x1; ++x) {
        for (std::size_t c = 0; c < channels.size(); ++c) {
          values.push_back(mean(aov, pixel(x, y), c));
        }
      }
    }
    result.planes.push_back({aov, std::move(values)});
  }
  return result;
}

}  // namespace solidtex::pathtracer
