#include "engine/space/encode.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "engine/common/error.h"
#include "engine/space/colors.h"
#include "engine/space/photograph_image.h"

namespace solidtex::engine {
namespace {

using Code = std::vector<float>;

constexpr std::uint64_t max_side = std::uint64_t{1} << 20, max_pixels = std::uint64_t{1} << 32;

Code average(const std::vector<Code>& codes) {
  Code result;
  for (std::size_t i = 0; i < codes.front().size(); ++i) {
    double sum = 0;
    for (const Code& code : codes) sum += code[i];
    result.push_back(static_cast<float>(sum / static_cast<double>(codes.size())));
  }
  return result;
}

double distance(const Code& a, const Code& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (double{a[i]} - b[i]) * (double{a[i]} - b[i]);
  return std::sqrt(sum);
}

// Returns the code with the least sum of distances to the others.
Code medoid(const std::vector<Code>& codes) {
  const auto spread = [&](const Code& code) {
    double sum = 0;
    for (const Code& other : codes) sum += distance(code, other);
    return sum;
  };
  return std::ranges::min(codes, {}, spread);
}

void check_finite(std::span<const float> pixels, std::size_t width) {
  const auto bad = std::ranges::find_if_not(pixels, [](float v) { return std::isfinite(v); });
  if (bad == pixels.end()) return;
  const auto pixel = static_cast<std::size_t>(bad - pixels.begin()) / 3;
  throw Error(SOLIDTEX_INVALID_ARGUMENT, "pixels: found " + std::to_string(*bad) + " at column " +
                                             std::to_string(pixel % width) + ", row " +
                                             std::to_string(pixel / width) +
                                             ", expected finite numbers");
}

}  // namespace

void check_photograph_size(const Space& space, std::size_t width, std::size_t height) {
  const auto side = static_cast<std::size_t>(space.patch);
  const std::string found =
      "the photograph has " + std::to_string(width) + " x " + std::to_string(height) + " pixels";
  if (width < side || height < side)
    throw Error(SOLIDTEX_INVALID_ARGUMENT, found + ", expected at least " + std::to_string(side) +
                                               " x " + std::to_string(side) +
                                               ", the encoder's patch");
  if (width > max_side || height > max_side || std::uint64_t{width} * height > max_pixels)
    throw Error(SOLIDTEX_INVALID_ARGUMENT, found + ", expected at most " +
                                               std::to_string(max_side) + " on a side and " +
                                               std::to_string(max_pixels) + " in all");
}

Material encode(const Space& space, const Encoder& encoder, std::span<const float> pixels,
                std::size_t width, std::size_t height, Patches chosen) {
  check_photograph_size(space, width, height);
  check_finite(pixels, width);
  Image image = reduced(pixels, width, height, static_cast<std::size_t>(space.resolution));
  if (space.is_upright) turn_upright(image);
  Material material;
  if (space.has_colors) {
    material.colors = photograph_colors(image.pixels);
    whiten(image, material.colors);
  }
  const auto codes = encoder.codes(patches(image, static_cast<std::size_t>(space.patch)));
  material.code = chosen == Patches::medoid ? medoid(codes) : average(codes);
  return material;
}

}  // namespace solidtex::engine
