// Containers of 3D textures with mip levels, for graphics cards.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "tools/bake/description.h"

namespace solidtex::tools {

struct TextureLevel {
  Index3 size;
  std::vector<std::byte> bytes;  // [z][y][x][channel], or blocks
};

struct TextureDescription {
  std::size_t channels;  // 1, 2 or 4
  Depth depth;
  bool is_srgb;        // of 8 bits
  bool is_bc7;         // four channels
  std::string writer;  // name and version of the program
  Fields fields;       // of KTX2
};

// Write a DirectX or a Khronos texture; levels begin with the largest. Throw WriteError.
void write_dds(const std::filesystem::path& path, const TextureDescription& texture,
               const std::vector<TextureLevel>& levels);
void write_ktx2(const std::filesystem::path& path, const TextureDescription& texture,
                const std::vector<TextureLevel>& levels);

}  // namespace solidtex::tools
