// BC7 block compression of 3D textures.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace solidtex::tools {

// Compresses RGBA in 8 bits, [z][y][x][channel], in blocks of 4 x 4 x 1 texels of 16 bytes each.
// Blocks beyond the border repeat its texels.
std::vector<std::byte> compress_bc7(std::span<const std::uint8_t> rgba, std::int64_t width,
                                    std::int64_t height, std::int64_t depth);

}  // namespace solidtex::tools
