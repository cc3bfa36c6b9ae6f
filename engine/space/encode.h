// From a photograph to a material of a space.
#pragma once

#include <cstddef>
#include <span>

#include "engine/space/encoder.h"

namespace solidtex::engine {

enum class Patches { average, medoid };

// Returns the material of pixels [row][column][channel] with three sRGB channels.
Material encode(const Space& space, const Encoder& encoder, std::span<const float> pixels,
                std::size_t width, std::size_t height, Patches patches);

// Throws Error unless a photograph of this size can be encoded.
void check_photograph_size(const Space& space, std::size_t width, std::size_t height);

}  // namespace solidtex::engine
