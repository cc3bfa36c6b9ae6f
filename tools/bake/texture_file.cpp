#include "tools/bake/texture_file.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

template <class Value>
void append(std::string& bytes, Value value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void append_words(std::string& bytes, const std::vector<std::uint64_t>& words) {
  for (const std::uint64_t word : words) append(bytes, static_cast<std::uint32_t>(word));
}

void align(std::string& bytes, std::size_t multiple) {
  bytes.resize((bytes.size() + multiple - 1) / multiple * multiple);
}

// Formats with one, two and four channels.
struct FormatCodes {
  std::uint32_t one, two, four;

  std::uint32_t of(std::size_t channels) const {
    return channels == 1 ? one : channels == 2 ? two : four;
  }
};

std::uint32_t dxgi_format(const TextureDescription& texture) {
  if (texture.is_bc7) return texture.is_srgb ? 99 : 98;
  if (texture.is_srgb) return 29;  // R8G8B8A8_UNORM_SRGB
  switch (texture.depth) {
    case Depth::uint8:
      return FormatCodes{61, 49, 28}.of(texture.channels);
    case Depth::uint16:
      return FormatCodes{56, 35, 11}.of(texture.channels);
    case Depth::half:
      return FormatCodes{54, 34, 10}.of(texture.channels);
    case Depth::float32:
      return FormatCodes{41, 16, 2}.of(texture.channels);
  }
  return 0;
}

std::uint32_t vulkan_format(const TextureDescription& texture) {
  if (texture.is_bc7) return texture.is_srgb ? 146 : 145;
  if (texture.is_srgb) return 43;  // R8G8B8A8_SRGB
  switch (texture.depth) {
    case Depth::uint8:
      return FormatCodes{9, 16, 37}.of(texture.channels);
    case Depth::uint16:
      return FormatCodes{70, 77, 91}.of(texture.channels);
    case Depth::half:
      return FormatCodes{76, 83, 97}.of(texture.channels);
    case Depth::float32:
      return FormatCodes{100, 103, 109}.of(texture.channels);
  }
  return 0;
}

// Bytes of a texel, or of a block.
std::size_t unit_bytes(const TextureDescription& texture) {
  return texture.is_bc7 ? 16 : texture.channels * bytes_per_value(texture.depth);
}

// The data format descriptor of KTX2, section 5 of the Khronos Data Format Specification.
std::string data_format(const TextureDescription& texture) {
  constexpr std::uint8_t rgb_model = 1, bc7_model = 134, bt709 = 1, linear = 1, srgb = 2;
  constexpr std::uint8_t alpha = 15, is_linear = 0x10, is_signed_float = 0xC0;
  constexpr std::uint16_t version = 2;
  const std::size_t samples = texture.is_bc7 ? 1 : texture.channels;
  const std::size_t block = 24 + 16 * samples;
  std::string bytes;
  append_words(bytes, {4 + block, 0});
  append(bytes, version);
  append(bytes, static_cast<std::uint16_t>(block));
  for (const std::uint8_t byte : {texture.is_bc7 ? bc7_model : rgb_model, bt709,
                                  texture.is_srgb ? srgb : linear, std::uint8_t{0}})
    append(bytes, byte);
  append_words(bytes, {texture.is_bc7 ? 0x0303u : 0u});  // edges of a block, less one
  append_words(bytes, {unit_bytes(texture), 0});
  const std::size_t bits = 8 * bytes_per_value(texture.depth);
  const bool is_float = texture.depth == Depth::half || texture.depth == Depth::float32;
  for (std::size_t i = 0; i < samples; ++i) {
    std::uint8_t channel = i == 3 ? alpha : static_cast<std::uint8_t>(i);
    if (i == 3 && texture.is_srgb) channel |= is_linear;
    if (is_float) channel |= is_signed_float;
    append(bytes, static_cast<std::uint16_t>(i * bits));
    append(bytes, static_cast<std::uint8_t>(texture.is_bc7 ? 127 : bits - 1));
    append(bytes, channel);
    append_words(bytes, {0});
    if (is_float) {
      append(bytes, -1.0f);
      append(bytes, 1.0f);
    } else {
      append_words(bytes, {0, texture.is_bc7 ? UINT32_MAX : (std::uint64_t{1} << bits) - 1});
    }
  }
  return bytes;
}

// Pairs in the order of their keys; x goes right, y down, z into the screen.
std::string key_values(const TextureDescription& texture) {
  std::string bytes;
  Fields pairs = texture.fields;
  pairs.emplace_back("KTXorientation", "rdi");
  pairs.emplace_back("KTXwriter", texture.writer);
  std::ranges::sort(pairs);
  for (const auto& [key, value] : pairs) {
    append_words(bytes, {key.size() + value.size() + 2});
    bytes += key + '\0' + value + '\0';
    align(bytes, 4);
  }
  return bytes;
}

}  // namespace

void write_dds(const std::filesystem::path& path, const TextureDescription& texture,
               const std::vector<TextureLevel>& levels) {
  constexpr std::uint32_t caps = 0x1, height = 0x2, width = 0x4, pitch = 0x8, format = 0x1000,
                          mip_count = 0x20000, linear_size = 0x80000, depth = 0x800000;
  constexpr std::uint32_t complex = 0x8, texture_caps = 0x1000, mipmap = 0x400000,
                          volume = 0x200000;
  constexpr std::uint32_t is_four_cc = 0x4, dimension_3d = 4;
  const auto [x, y, z] = levels[0].size;
  const std::uint64_t row = static_cast<std::uint64_t>(x) * unit_bytes(texture);
  std::string header = "DDS ";
  append_words(header, {124,
                        caps | height | width | format | mip_count | depth |
                            (texture.is_bc7 ? linear_size : pitch),
                        static_cast<std::uint64_t>(y), static_cast<std::uint64_t>(x),
                        texture.is_bc7 ? levels[0].bytes.size() / static_cast<std::size_t>(z) : row,
                        static_cast<std::uint64_t>(z), levels.size()});
  header.resize(header.size() + 44);  // eleven words are reserved
  append_words(header, {32, is_four_cc});
  header += "DX10";
  header.resize(header.size() + 20);  // five words of other formats
  append_words(header, {complex | texture_caps | mipmap, volume, 0, 0, 0});
  append_words(header, {dxgi_format(texture), dimension_3d, 0, 1, 0});

  OutputFile file(path);
  file.write(0, header.data(), header.size());
  std::uint64_t offset = header.size();
  for (const TextureLevel& level : levels) {
    file.write(offset, level.bytes.data(), level.bytes.size());
    offset += level.bytes.size();
  }
  file.close();
}

void write_ktx2(const std::filesystem::path& path, const TextureDescription& texture,
                const std::vector<TextureLevel>& levels) {
  const std::string format = data_format(texture), keys = key_values(texture);
  constexpr std::size_t head = 80, index_entry = 24;
  const std::size_t format_at = head + index_entry * levels.size();
  const std::size_t keys_at = format_at + format.size();
  std::string header("\xABKTX 20\xBB\r\n\x1A\n", 12);
  const auto [x, y, z] = levels[0].size;
  append_words(header, {vulkan_format(texture), texture.is_bc7 ? 1 : bytes_per_value(texture.depth),
                        static_cast<std::uint64_t>(x), static_cast<std::uint64_t>(y),
                        static_cast<std::uint64_t>(z), 0, 1, levels.size(), 0});
  append_words(header, {format_at, format.size(), keys_at, keys.size(), 0, 0, 0, 0});

  // The smallest level lies first, so that a stream shows something early.
  const std::uint64_t unit = std::max<std::uint64_t>(unit_bytes(texture), 4);
  std::vector<std::uint64_t> offsets(levels.size());
  std::uint64_t end = keys_at + keys.size();
  for (std::size_t i = levels.size(); i-- > 0;) {
    offsets[i] = (end + unit - 1) / unit * unit;
    end = offsets[i] + levels[i].bytes.size();
  }
  for (std::size_t i = 0; i < levels.size(); ++i)
    for (const std::uint64_t number :
         {offsets[i], std::uint64_t{levels[i].bytes.size()}, std::uint64_t{levels[i].bytes.size()}})
      append(header, number);
  header += format + keys;

  OutputFile file(path);
  file.write(0, header.data(), header.size());
  for (std::size_t i = levels.size(); i-- > 0;)
    file.write(offsets[i], levels[i].bytes.data(), levels[i].bytes.size());
  file.close();
}

}  // namespace solidtex::tools
