// The picture while it is made: sums over samples of the layers that are asked for.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <solidtex/picture.hpp>
#include <span>
#include <vector>

namespace solidtex::pathtracer {

// What a sample meets first.
struct FirstHit {
  glm::vec3 albedo{0}, normal{0}, position{0};
  float depth = 0;
  bool is_object = false;  // else the layers above are 0
  glm::vec3 texcoord{0};
  float footprint = 0;
  bool is_textured = false;  // by a solid texture; else the two above are 0
};

class Framebuffer {
 public:
  // `estimates_noise`: relative_error() will be asked for.
  Framebuffer(const Window& window, const LayerSet& layers, bool estimates_noise);

  const Window& window() const { return window_; }
  std::size_t pixel(int x, int y) const {
    return static_cast<std::size_t>(y - window_.y0) * static_cast<std::size_t>(window_.width()) +
           static_cast<std::size_t>(x - window_.x0);
  }

  // One sample is at most one of each of these, then count_samples. Different threads may add to
  // different pixels.
  void add_light(std::size_t pixel, const glm::vec3& radiance);
  void add_first_hit(std::size_t pixel, const FirstHit& hit);
  void add_cost(std::size_t pixel, std::uint32_t points);
  void count_samples(std::size_t pixel, std::uint32_t count) { counts_[pixel] += count; }

  std::uint32_t sample_count(std::size_t pixel) const { return counts_[pixel]; }

  // Standard error of the means of a block's pixels, root mean square over them and their channels,
  // relative to their mean, which counts as 0.01 where it is less. Samples are taken to be
  // independent; they are spread more evenly, so that the true error is smaller.
  double relative_error(const Window& block) const;

  // All that it holds, as bytes and in a fixed order.
  std::vector<std::span<std::byte>> arrays();

  // The part of a picture of this size; `crop` lies in the window.
  Picture picture(int width, int height, const Window& crop) const;

 private:
  std::vector<double>& sums(Layer layer) { return sums_[static_cast<std::size_t>(layer)]; }
  const std::vector<double>& sums(Layer layer) const {
    return sums_[static_cast<std::size_t>(layer)];
  }
  void add(Layer layer, std::size_t pixel, const glm::vec3& value);
  float mean(Layer layer, std::size_t pixel, std::size_t channel) const;
  double variance_of_mean(std::size_t pixel, std::size_t channel) const;

  Window window_;
  LayerSet layers_;
  std::vector<std::uint32_t> counts_;           // samples of each pixel
  std::vector<std::uint32_t> hits_, textured_;  // those that met an object, a solid texture
  // By layer, empty where it is not needed; those of the variance are of squares.
  std::array<std::vector<double>, kLayerCount> sums_;
};

}  // namespace solidtex::pathtracer
