#include "plugins/pathtracer/film/framebuffer.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace solidtex::pathtracer {
namespace {

constexpr double kDarkest = 0.01;  // so that black parts are not sampled for ever

}  // namespace

Framebuffer::Framebuffer(const Window& window, const LayerSet& layers, bool estimates_noise)
    : window_(window), layers_(layers) {
  LayerSet summed = layers;
  if (estimates_noise) summed.add(Layer::variance);
  if (summed.has(Layer::variance)) summed.add(Layer::beauty);
  const std::size_t pixels = window.pixel_count();
  counts_.resize(pixels);
  if (layers.has_any({Layer::depth, Layer::position})) hits_.resize(pixels);
  if (layers.has_any({Layer::texcoord, Layer::footprint})) textured_.resize(pixels);
  for (const LayerInfo& layer : all_layers()) {
    if (summed.has(layer.layer) && layer.layer != Layer::samples) {
      sums(layer.layer).resize(pixels * layer.channels.size());
    }
  }
}

void Framebuffer::add(Layer layer, std::size_t pixel, const glm::vec3& value) {
  if (sums(layer).empty()) return;
  for (int c = 0; c < 3; ++c) sums(layer)[3 * pixel + static_cast<std::size_t>(c)] += value[c];
}

void Framebuffer::add_light(std::size_t pixel, const glm::vec3& radiance) {
  add(Layer::beauty, pixel, radiance);
  if (sums(Layer::variance).empty()) return;
  for (int c = 0; c < 3; ++c) {
    const double value = radiance[c];
    sums(Layer::variance)[3 * pixel + static_cast<std::size_t>(c)] += value * value;
  }
}

void Framebuffer::add_first_hit(std::size_t pixel, const FirstHit& hit) {
  add(Layer::albedo, pixel, hit.albedo);
  add(Layer::normal, pixel, hit.normal);
  add(Layer::position, pixel, hit.position);
  add(Layer::texcoord, pixel, hit.texcoord);
  if (!sums(Layer::depth).empty()) sums(Layer::depth)[pixel] += hit.depth;
  if (!sums(Layer::footprint).empty()) sums(Layer::footprint)[pixel] += hit.footprint;
  if (!hits_.empty()) hits_[pixel] += hit.is_object;
  if (!textured_.empty()) textured_[pixel] += hit.is_textured;
}

void Framebuffer::add_cost(std::size_t pixel, std::uint32_t points) {
  sums(Layer::cost)[pixel] += points;
}

double Framebuffer::variance_of_mean(std::size_t pixel, std::size_t channel) const {
  const double n = counts_[pixel];
  if (n < 2) return std::numeric_limits<double>::infinity();
  const double sum = sums(Layer::beauty)[3 * pixel + channel];
  const double squares = sums(Layer::variance)[3 * pixel + channel];
  return std::max(0.0, squares - sum * sum / n) / ((n - 1) * n);
}

double Framebuffer::relative_error(const Window& block) const {
  double variance = 0, mean = 0;
  for (int y = block.y0; y < block.y1; ++y) {
    for (std::size_t i = pixel(block.x0, y); i < pixel(block.x1, y); ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        variance += variance_of_mean(i, c);
        mean += sums(Layer::beauty)[3 * i + c] / counts_[i];
      }
    }
  }
  const double values = 3 * static_cast<double>(block.pixel_count());
  return std::sqrt(variance / values) / std::max(mean / values, kDarkest);
}

float Framebuffer::mean(Layer layer, std::size_t pixel, std::size_t channel) const {
  if (layer == Layer::samples) return static_cast<float>(counts_[pixel]);
  if (layer == Layer::variance) return static_cast<float>(variance_of_mean(pixel, channel));
  const std::size_t channels = info(layer).channels.size();
  std::uint32_t count = counts_[pixel];
  if (layer == Layer::depth || layer == Layer::position) count = hits_[pixel];
  if (layer == Layer::texcoord || layer == Layer::footprint) count = textured_[pixel];
  if (count == 0) return layer == Layer::depth ? std::numeric_limits<float>::infinity() : 0.0f;
  return static_cast<float>(sums(layer)[channels * pixel + channel] / count);
}

std::vector<std::span<std::byte>> Framebuffer::arrays() {
  std::vector<std::span<std::byte>> result;
  for (auto* values : {&counts_, &hits_, &textured_}) {
    result.push_back(std::as_writable_bytes(std::span(*values)));
  }
  for (auto& values : sums_) result.push_back(std::as_writable_bytes(std::span(values)));
  return result;
}

Picture Framebuffer::picture(int width, int height, const Window& crop) const {
  Picture result{width, height, crop, {}};
  for (const auto& [layer, name, channels] : all_layers()) {
    if (!layers_.has(layer)) continue;
    std::vector<float> values;
    values.reserve(crop.pixel_count() * channels.size());
    for (int y = crop.y0; y < crop.y1; ++y) {
      for (int x = crop.x0; x < crop.x1; ++x) {
        for (std::size_t c = 0; c < channels.size(); ++c) {
          values.push_back(mean(layer, pixel(x, y), c));
        }
      }
    }
    result.planes.push_back({layer, std::move(values)});
  }
  return result;
}

}  // namespace solidtex::pathtracer
