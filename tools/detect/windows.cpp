#include "tools/detect/windows.h"

#include <algorithm>
#include <cmath>

#include "tools/common/cli.h"

namespace solidtex::tools {
namespace {

constexpr double kPaperDimensions = 2;

std::vector<std::size_t> corners(std::size_t first, std::size_t extent, std::size_t side,
                                 std::size_t step) {
  std::vector<std::size_t> found;
  for (std::size_t offset = 0; offset + side < extent; offset += step)
    found.push_back(first + offset);
  found.push_back(first + extent - side);
  return found;
}

std::vector<float> cut(const Photograph& photograph, std::size_t left, std::size_t top,
                       std::size_t side) {
  std::vector<float> pixels;
  pixels.reserve(3 * side * side);
  for (std::size_t row = top; row < top + side; ++row) {
    const float* from = &photograph.pixels[3 * (row * photograph.width + left)];
    pixels.insert(pixels.end(), from, from + 3 * side);
  }
  return pixels;
}

// Place of a pixel between the middles of two windows.
struct Between {
  std::size_t low, high;
  float share;  // of the higher
};

std::vector<Between> places(const std::vector<std::size_t>& corners, std::size_t side,
                            std::size_t extent) {
  std::vector<Between> result;
  std::size_t low = 0;
  for (std::size_t pixel = 0; pixel < extent; ++pixel) {
    const double at = static_cast<double>(pixel) + 0.5 - static_cast<double>(side) / 2;
    while (low + 1 < corners.size() && static_cast<double>(corners[low + 1]) <= at) ++low;
    const std::size_t high = std::min(low + 1, corners.size() - 1);
    const auto from = static_cast<double>(corners[low]);
    const double span = std::max(1.0, static_cast<double>(corners[high]) - from);
    result.push_back({low, high, static_cast<float>(std::clamp((at - from) / span, 0.0, 1.0))});
  }
  return result;
}

}  // namespace

Windows encode_windows(const solidtex::space& space, const Photograph& photograph,
                       const Rectangle& part, std::size_t step) {
  const std::size_t side = space.patch_size();
  Windows windows{
      corners(part.left, part.width, side, step), corners(part.top, part.height, side, step), {}};
  for (const std::size_t top : windows.tops)
    for (const std::size_t left : windows.lefts) {
      throw_if_interrupted();
      windows.codes.push_back(space.encode(cut(photograph, left, top, side), side, side).code);
    }
  return windows;
}

Code mean(const std::vector<Code>& codes) {
  Code result;
  for (std::size_t i = 0; i < codes.front().size(); ++i) {
    double sum = 0;
    for (const Code& code : codes) sum += code[i];
    result.push_back(static_cast<float>(sum / static_cast<double>(codes.size())));
  }
  return result;
}

std::vector<float> similarities(const Windows& windows, const Code& wanted, double alpha) {
  std::vector<float> result;
  for (const Code& code : windows.codes) {
    double squares = 0;
    for (std::size_t i = 0; i < code.size(); ++i) {
      const double difference = double{code[i]} - double{wanted[i]};
      squares += difference * difference;
    }
    squares *= kPaperDimensions / static_cast<double>(code.size());
    result.push_back(static_cast<float>(std::exp(-alpha * squares)));
  }
  return result;
}

std::vector<float> interpolated(const Windows& windows, const std::vector<float>& values,
                                std::size_t side, std::size_t width, std::size_t height) {
  const auto columns = places(windows.lefts, side, width);
  const auto rows = places(windows.tops, side, height);
  const auto value = [&](std::size_t top, std::size_t left) {
    return values[top * windows.lefts.size() + left];
  };
  std::vector<float> heat;
  heat.reserve(width * height);
  for (const Between& row : rows)
    for (const Between& column : columns) {
      const auto along = [&](std::size_t top) {
        return std::lerp(value(top, column.low), value(top, column.high), column.share);
      };
      heat.push_back(std::lerp(along(row.low), along(row.high), row.share));
    }
  return heat;
}

}  // namespace solidtex::tools
