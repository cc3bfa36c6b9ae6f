// The photograph as the encoder sees it.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "engine/space/space.h"

namespace solidtex::engine {

// Pixels [row][column][channel] with three sRGB channels.
struct Image {
  std::size_t width = 0, height = 0;
  std::vector<float> pixels;
};

// Returns the image reduced so that its shorter side has at most `resolution` pixels (Lanczos, as
// the photographs of the training).
Image reduced(std::span<const float> pixels, std::size_t width, std::size_t height,
              std::size_t resolution);

// Transposes an image whose structures are longer along rows than along columns.
void turn_upright(Image& image);

// Turns colors into whitened values: basis^-1 (color - mean).
void whiten(Image& image, const Colors& colors);

// Returns patches [patch][channel][row][column] on a grid that reaches every border.
std::vector<float> patches(const Image& image, std::size_t side);

}  // namespace solidtex::engine
