#include "engine/space/photograph_image.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "engine/common/parallel.h"

namespace solidtex::engine {
namespace {

constexpr double lanczos_support = 3;
constexpr std::size_t max_patches_per_axis = 16;  // of a panorama

double sinc(double x) {
  return x == 0 ? 1 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x);
}

double lanczos(double x) {
  return std::abs(x) < lanczos_support ? sinc(x) * sinc(x / lanczos_support) : 0;
}

// Weights of the inputs [first, first + size) for one output.
struct Taps {
  std::size_t first = 0;
  std::vector<float> weights;
};

std::vector<Taps> reduction_taps(std::size_t from, std::size_t to) {
  const double scale = static_cast<double>(from) / static_cast<double>(to);
  std::vector<Taps> result(to);
  for (std::size_t i = 0; i < to; ++i) {
    const double center = (static_cast<double>(i) + 0.5) * scale;
    const double low = std::max(center - lanczos_support * scale + 0.5, 0.0);
    const double high = std::min(center + lanczos_support * scale + 0.5, static_cast<double>(from));
    Taps& taps = result[i];
    taps.first = static_cast<std::size_t>(low);
    double sum = 0;
    std::vector<double> weights;
    for (std::size_t k = taps.first; k < static_cast<std::size_t>(high); ++k) {
      weights.push_back(lanczos((static_cast<double>(k) + 0.5 - center) / scale));
      sum += weights.back();
    }
    for (const double weight : weights) taps.weights.push_back(static_cast<float>(weight / sum));
  }
  return result;
}

// Reduces the columns of pixels, and transposes: [row][column] becomes [column][row].
std::vector<float> reduce_columns(std::span<const float> pixels, std::size_t width,
                                  std::size_t height, std::size_t new_width) {
  const auto taps = reduction_taps(width, new_width);
  std::vector<float> result(3 * new_width * height);
  for_each_part(height, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row)
      for (std::size_t column = 0; column < new_width; ++column) {
        const float* from = pixels.data() + 3 * (row * width + taps[column].first);
        float sum[3] = {};
        for (const float weight : taps[column].weights)
          for (float& channel : sum) channel += weight * *from++;
        std::ranges::copy(sum, result.data() + 3 * (column * height + row));
      }
  });
  return result;
}

std::size_t scaled(std::size_t size, double factor) {
  return static_cast<std::size_t>(std::nearbyint(static_cast<double>(size) * factor));
}

// First pixels of patches along one axis, about half a patch apart.
std::vector<std::size_t> grid(std::size_t extent, std::size_t side) {
  const std::size_t rest = extent - side;
  const std::size_t steps = std::min((rest + side / 2 - 1) / std::max<std::size_t>(side / 2, 1),
                                     max_patches_per_axis - 1);
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i <= steps; ++i) result.push_back(steps ? rest * i / steps : 0);
  return result;
}

Image transposed(const Image& image) {
  Image result{image.height, image.width, std::vector<float>(image.pixels.size())};
  for (std::size_t row = 0; row < image.height; ++row)
    for (std::size_t column = 0; column < image.width; ++column)
      std::copy_n(image.pixels.data() + 3 * (row * image.width + column), 3,
                  result.pixels.data() + 3 * (column * image.height + row));
  return result;
}

// Returns the mean over channels of their variance.
double variance(const Image& image) {
  const std::size_t pixels = image.pixels.size() / 3;
  const auto count = static_cast<double>(pixels);
  double result = 0;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    double mean = 0, squares = 0;
    for (std::size_t i = channel; i < image.pixels.size(); i += 3) mean += image.pixels[i] / count;
    for (std::size_t i = channel; i < image.pixels.size(); i += 3)
      squares += (image.pixels[i] - mean) * (image.pixels[i] - mean);
    result += squares / (count - 1) / 3;
  }
  return result;
}

// Returns the mean squared difference of pixels that are `lag` columns apart.
double squared_difference(const Image& image, std::size_t lag) {
  double sum = 0;
  const std::size_t stride = 3 * image.width;
  for (std::size_t row = 0; row < image.height; ++row) {
    const float* pixels = image.pixels.data() + row * stride;
    for (std::size_t i = 3 * lag; i < stride; ++i)
      sum += (double{pixels[i]} - pixels[i - 3 * lag]) * (double{pixels[i]} - pixels[i - 3 * lag]);
  }
  return sum / static_cast<double>(image.height * (stride - 3 * lag));
}

// Returns the distance along rows at which the mean squared difference is half that of unrelated
// pixels, as the training measures it.
double correlation_length(const Image& image) {
  const double half = variance(image);
  double previous = 0;
  for (std::size_t lag = 1; lag < image.width / 2; ++lag) {
    const double difference = squared_difference(image, lag);
    if (difference >= half)
      return static_cast<double>(lag) - 1 +
             (half - previous) / std::max(difference - previous, 1e-12);
    previous = difference;
  }
  return static_cast<double>(image.width) / 2;
}

}  // namespace

void turn_upright(Image& image) {
  Image turned = transposed(image);
  if (correlation_length(turned) < correlation_length(image)) image = std::move(turned);
}

Image reduced(std::span<const float> pixels, std::size_t width, std::size_t height,
              std::size_t resolution) {
  const double factor =
      static_cast<double>(resolution) / static_cast<double>(std::min(width, height));
  if (factor >= 1) return {width, height, {pixels.begin(), pixels.end()}};
  const std::size_t new_width = scaled(width, factor), new_height = scaled(height, factor);
  const auto columns = reduce_columns(pixels, width, height, new_width);
  return {new_width, new_height, reduce_columns(columns, height, new_width, new_height)};
}

void whiten(Image& image, const Colors& colors) {
  const auto b = [&](std::size_t r, std::size_t k) { return double{colors[4 * r + k]}; };
  const auto cofactor = [&](std::size_t r, std::size_t k) {
    const std::size_t r1 = (r + 1) % 3, r2 = (r + 2) % 3, k1 = (k + 1) % 3, k2 = (k + 2) % 3;
    return b(r1, k1) * b(r2, k2) - b(r1, k2) * b(r2, k1);
  };
  double determinant = 0;
  for (std::size_t k = 0; k < 3; ++k) determinant += b(0, k) * cofactor(0, k);
  for (std::size_t i = 0; i < image.pixels.size(); i += 3) {
    double y[3] = {};
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t r = 0; r < 3; ++r)
        y[k] += cofactor(r, k) / determinant * (image.pixels[i + r] - double{colors[4 * r + 3]});
    for (std::size_t k = 0; k < 3; ++k) image.pixels[i + k] = static_cast<float>(y[k]);
  }
}

std::vector<float> patches(const Image& image, std::size_t side) {
  std::vector<float> result;
  for (const std::size_t top : grid(image.height, side))
    for (const std::size_t left : grid(image.width, side))
      for (std::size_t channel = 0; channel < 3; ++channel)
        for (std::size_t row = 0; row < side; ++row)
          for (std::size_t column = 0; column < side; ++column)
            result.push_back(
                image.pixels[3 * ((top + row) * image.width + left + column) + channel]);
  return result;
}

}  // namespace solidtex::engine
