#include "tools/bake/bc7.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>

namespace solidtex::tools {
namespace {

// All blocks have mode 6: one line of colors, ends of 7 bits a channel and one more bit for all
// four, and 16 colors between them. The material of a block of 4 x 4 texels is close to a line.
constexpr std::array<int, 16> weights{0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64};

using Block = std::array<glm::vec4, 16>;

struct Ends {
  glm::ivec4 first, second;  // 8 bits; the lowest bit of a vector's parts is the same
};

struct Code {
  Ends ends{};
  std::array<int, 16> indices{};
  float error = std::numeric_limits<float>::max();
};

glm::ivec4 round_end(const glm::vec4& color, int low_bit) {
  const glm::vec4 high = glm::round((color - static_cast<float>(low_bit)) / 2.0f);
  return 2 * glm::ivec4(glm::clamp(high, 0.0f, 127.0f)) + low_bit;
}

Code choose_indices(const Block& block, const Ends& ends) {
  std::array<glm::vec4, 16> colors;
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const int weight = weights[i];
    colors[i] = glm::vec4(((64 - weight) * ends.first + weight * ends.second + 32) >> 6);
  }
  const glm::vec4 axis = colors[15] - colors[0];
  const float scale = 15 / std::max(glm::dot(axis, axis), 1e-6f);
  Code code{ends, {}, 0};
  for (std::size_t texel = 0; texel < block.size(); ++texel) {
    // Weights are nearly even: the nearest color is next to the even one.
    const int guess =
        static_cast<int>(std::lround(glm::dot(block[texel] - colors[0], axis) * scale));
    float nearest = std::numeric_limits<float>::max();
    for (int i = std::clamp(guess - 1, 0, 15); i <= std::clamp(guess + 1, 0, 15); ++i) {
      const glm::vec4 difference = block[texel] - colors[static_cast<std::size_t>(i)];
      const float error = glm::dot(difference, difference);
      if (error >= nearest) continue;
      nearest = error;
      code.indices[texel] = i;
    }
    code.error += nearest;
  }
  return code;
}

// Tries the four pairs of low bits.
void improve(const Block& block, const glm::vec4& first, const glm::vec4& second, Code& best) {
  for (int bits = 0; bits < 4; ++bits) {
    const Code code =
        choose_indices(block, {round_end(first, bits & 1), round_end(second, bits >> 1)});
    if (code.error < best.error) best = code;
  }
}

// The direction in which the colors differ most, by power iteration.
glm::vec4 principal_axis(const Block& block, const glm::vec4& mean) {
  glm::mat4 covariance(0);
  for (const glm::vec4& color : block) covariance += glm::outerProduct(color - mean, color - mean);
  glm::vec4 axis(1, 1, 1, 0.5f);
  for (int i = 0; i < 8; ++i) {
    const glm::vec4 next = covariance * axis;
    const float length = glm::length(next);
    if (length < 1e-6f) return glm::vec4(0);
    axis = next / length;
  }
  return axis;
}

// The ends with the least squared error for given indices.
void refine(const Block& block, Code& best) {
  float aa = 0, ab = 0, bb = 0;
  glm::vec4 a_sum(0), b_sum(0);
  for (std::size_t texel = 0; texel < block.size(); ++texel) {
    const float b = static_cast<float>(weights[static_cast<std::size_t>(best.indices[texel])]) / 64;
    const float a = 1 - b;
    aa += a * a;
    ab += a * b;
    bb += b * b;
    a_sum += a * block[texel];
    b_sum += b * block[texel];
  }
  const float determinant = aa * bb - ab * ab;
  if (determinant < 1e-4f) return;
  improve(block, (bb * a_sum - ab * b_sum) / determinant, (aa * b_sum - ab * a_sum) / determinant,
          best);
}

class BitWriter {
 public:
  void put(int value, int count) {
    for (int i = 0; i < count; ++i, ++at_)
      bytes_[at_ / 8] |= static_cast<std::byte>(((value >> i) & 1) << (at_ % 8));
  }
  const std::array<std::byte, 16>& bytes() const { return bytes_; }

 private:
  std::array<std::byte, 16> bytes_{};
  std::size_t at_ = 0;
};

std::array<std::byte, 16> write(Code code) {
  // The highest bit of the first index is not stored: it is 0.
  if (code.indices[0] >= 8) {
    std::swap(code.ends.first, code.ends.second);
    for (int& index : code.indices) index = 15 - index;
  }
  BitWriter bits;
  constexpr int mode = 6;
  bits.put(1 << mode, mode + 1);
  for (int channel = 0; channel < 4; ++channel) {
    bits.put(code.ends.first[channel] >> 1, 7);
    bits.put(code.ends.second[channel] >> 1, 7);
  }
  bits.put(code.ends.first[0], 1);
  bits.put(code.ends.second[0], 1);
  for (std::size_t i = 0; i < code.indices.size(); ++i) bits.put(code.indices[i], i == 0 ? 3 : 4);
  return bits.bytes();
}

std::array<std::byte, 16> compress(const Block& block) {
  glm::vec4 mean(0);
  for (const glm::vec4& color : block) mean += color / 16.0f;
  const glm::vec4 axis = principal_axis(block, mean);
  float low = 0, high = 0;
  for (const glm::vec4& color : block) {
    const float along = glm::dot(color - mean, axis);
    low = std::min(low, along);
    high = std::max(high, along);
  }
  Code best;
  improve(block, mean + low * axis, mean + high * axis, best);
  for (int i = 0; i < 2; ++i) refine(block, best);
  return write(best);
}

}  // namespace

std::vector<std::byte> compress_bc7(std::span<const std::uint8_t> rgba, std::int64_t width,
                                    std::int64_t height, std::int64_t depth) {
  const std::int64_t columns = (width + 3) / 4, rows = (height + 3) / 4;
  std::vector<std::byte> bytes(static_cast<std::size_t>(columns * rows * depth) * 16);
  tbb::parallel_for(std::int64_t{0}, rows * depth, [&](std::int64_t row) {
    const std::int64_t z = row / rows, top = row % rows * 4;
    for (std::int64_t column = 0; column < columns; ++column) {
      Block block;
      for (std::int64_t i = 0; i < 16; ++i) {
        const std::int64_t x = std::min(4 * column + i % 4, width - 1);
        const std::int64_t y = std::min(top + i / 4, height - 1);
        const std::uint8_t* texel =
            &rgba[static_cast<std::size_t>((z * height + y) * width + x) * 4];
        block[static_cast<std::size_t>(i)] = {texel[0], texel[1], texel[2], texel[3]};
      }
      std::ranges::copy(compress(block),
                        &bytes[static_cast<std::size_t>(row * columns + column) * 16]);
    }
  });
  return bytes;
}

}  // namespace solidtex::tools
