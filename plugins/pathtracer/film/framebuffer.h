// Accumulates samples: sums over samples of the requested AOVs.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <solidtex/image.hpp>
#include <span>
#include <vector>

namespace solidtex::pathtracer {

// AOVs of a sample's first intersection.
struct FirstHit {
  glm::vec3 albedo{0}, normal{0}, position{0};
  float depth = 0;
  bool is_object = false;  // if false the values above are 0
  glm::vec3 texcoord{0};
  float footprint = 0;
  bool is_textured = false;  // by a solid texture; if false the two values above are 0
};

class Framebuffer {
 public:
  // `estimates_noise`: enables relative_error().
  Framebuffer(const Window& window, const AovSet& aovs, bool estimates_noise);

  const Window& window() const { return window_; }
  std::size_t pixel(int x, int y) const {
    return static_cast<std::size_t>(y - window_.y0) * static_cast<std::size_t>(window_.width()) +
           static_cast<std::size_t>(x - window_.x0);
  }

  // A sample calls each of these at most once, then count_samples. Different threads may add to
  // different pixels.
  void add_radiance(std::size_t pixel, const glm::vec3& radiance);
  void add_first_hit(std::size_t pixel, const FirstHit& hit);
  void add_cost(std::size_t pixel, std::uint32_t points);
  void count_samples(std::size_t pixel, std::uint32_t count) { counts_[pixel] += count; }

  std::uint32_t sample_count(std::size_t pixel) const { return counts_[pixel]; }

  // Root mean square, over a block's pixels and channels, of the standard error of the pixel mean,
  // relative to the block's mean (at least 0.01). Samples count as independent; they are
  // stratified, so the true error is smaller.
  double relative_error(const Window& block) const;

  // Views of all accumulated data, in a fixed order.
  std::vector<std::span<std::byte>> arrays();

  // Returns the means over samples. `crop` lies in the window of an image of `width` x `height`.
  AovImage image(int width, int height, const Window& crop) const;

 private:
  std::vector<double>& sums(Aov aov) { return sums_[static_cast<std::size_t>(aov)]; }
  const std::vector<double>& sums(Aov aov) const { return sums_[static_cast<std::size_t>(aov)]; }
  void add(Aov aov, std::size_t pixel, const glm::vec3& value);
  float mean(Aov aov, std::size_t pixel, std::size_t channel) const;
  double variance_of_mean(std::size_t pixel, std::size_t channel) const;

  Window window_;
  AovSet aovs_;
  std::vector<std::uint32_t> counts_;           // samples of each pixel
  std::vector<std::uint32_t> hits_, textured_;  // samples that hit an object, a solid texture
  // By AOV; empty if not needed. Those of the variance are sums of squares.
  std::array<std::vector<double>, kAovCount> sums_;
};

}  // namespace solidtex::pathtracer
