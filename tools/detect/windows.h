// Codes of a photograph's windows, and the heat map of one code among them.
#pragma once

#include <cstddef>
#include <solidtex/solidtex.hpp>
#include <vector>

#include "tools/encode/photograph.h"

namespace solidtex::tools {

using Code = std::vector<float>;

// Part of a photograph, in pixels.
struct Rectangle {
  std::size_t left = 0, top = 0, width = 0, height = 0;
};

// Codes of windows as large as the encoder's patch, whose corners are on a grid.
struct Windows {
  std::vector<std::size_t> lefts, tops;
  std::vector<Code> codes;  // [top][left]
};

// Encodes windows every `step` pixels, and those at the right and the lower border.
Windows encode_windows(const solidtex::space& space, const Photograph& photograph,
                       const Rectangle& part, std::size_t step);

// Returns the mean of codes.
Code mean(const std::vector<Code>& codes);

// Returns exp(-alpha d^2) for each code of the windows: equation 10 of Alanov et al. 2019. d is the
// distance from `wanted`, scaled from the dimensions of the code to the paper's two.
std::vector<float> similarities(const Windows& windows, const Code& wanted, double alpha);

// Interpolates values of windows, at their middles, to every pixel [row][column].
std::vector<float> interpolated(const Windows& windows, const std::vector<float>& values,
                                std::size_t side, std::size_t width, std::size_t height);

}  // namespace solidtex::tools
