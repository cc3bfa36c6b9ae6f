// Opens image files with the one reader of OpenImageIO that their first bytes ask for.
#pragma once

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace solidtex {

// Formats that are read. ImageInput::open would give a file whose ending says nothing to some
// twenty readers more, in turn, and some of them end the process at a file that is not theirs.
inline constexpr const char* kImageFormats =
    "PNG, JPEG, TIFF, OpenEXR, Radiance HDR, BMP, TGA, WebP, PNM, GIF or JPEG 2000";

// OpenImageIO's name of the format of a file whose first 12 bytes, or all of fewer, are `bytes`;
// empty for any other. TGA files have no beginning of their own, so `ending` is their sign: ".tga".
inline std::string image_format(std::string_view bytes, std::string ending) {
  using namespace std::string_view_literals;
  struct Format {
    std::string_view beginning;
    const char* name;
  };
  static constexpr Format formats[] = {
      {"\x89PNG\r\n\x1a\n"sv, "png"},
      {"\xff\xd8\xff"sv, "jpeg"},
      {"II*\0"sv, "tiff"},
      {"MM\0*"sv, "tiff"},
      {"II+\0"sv, "tiff"},
      {"MM\0+"sv, "tiff"},
      {"\x76\x2f\x31\x01"sv, "openexr"},
      {"#?"sv, "hdr"},
      {"BM"sv, "bmp"},
      {"GIF8"sv, "gif"},
      {"\xff\x4f\xff\x51"sv, "jpeg2000"},
      {"\0\0\0\x0cjP  "sv, "jpeg2000"},
  };
  for (const Format& format : formats)
    if (bytes.starts_with(format.beginning)) return format.name;
  if (bytes.starts_with("RIFF") && bytes.ends_with("WEBP")) return "webp";
  if (bytes.size() > 2 && bytes[0] == 'P' && "1234567Ff"sv.find(bytes[1]) != bytes.npos &&
      std::isspace(static_cast<unsigned char>(bytes[2])))
    return "pnm";
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending == ".tga" ? "targa" : "";
}

// The first line of a library's message, which may quote bytes of a file: without control
// characters.
inline std::string first_line(std::string text) {
  text.resize(std::min(text.size(), text.find('\n')));
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < ' ' || c == 0x7F; }, '?');
  return text;
}

// Rows to read at once: those of a row of tiles, or about 64 MiB of floats. Whoever reads in such
// strips takes memory for what a file holds, not for what its header promises.
inline int strip_height(const OIIO::ImageSpec& spec) {
  if (spec.tile_height > 0) return spec.tile_height;
  const std::int64_t row = std::int64_t{spec.width} * spec.nchannels * std::int64_t{sizeof(float)};
  return static_cast<int>(
      std::clamp<std::int64_t>((64 << 20) / std::max<std::int64_t>(row, 1), 1, 256));
}

// Replaces `values` by channels [first, end) of the rows [top, bottom) of a part of a file. Returns
// why they cannot be read, or nothing. Of a file that is cut short some formats say so and
// nevertheless succeed.
inline std::optional<std::string> read_rows(OIIO::ImageInput& input, const OIIO::ImageSpec& spec,
                                            int part, int top, int bottom, int first, int end,
                                            std::vector<float>& values) {
  constexpr auto type = OIIO::TypeDesc::FLOAT;
  values.resize(static_cast<std::size_t>(bottom - top) * static_cast<std::size_t>(spec.width) *
                static_cast<std::size_t>(end - first));
  const bool is_read =
      spec.tile_height > 0
          ? input.read_tiles(part, 0, spec.x, spec.x + spec.width, top, bottom, 0, 1, first, end,
                             type, values.data())
          : input.read_scanlines(part, 0, top, bottom, 0, first, end, type, values.data());
  const std::string error = input.geterror();
  if (is_read && error.empty()) return std::nullopt;
  return first_line(error);
}

// What about an image cannot be read safely; empty if nothing.
inline std::string obstacle(const OIIO::ImageSpec& spec) {
  constexpr int max_channels = 1024;
  constexpr std::int64_t max_values = std::int64_t{1} << 28;  // decoded at once: 1 GiB
  if (spec.nchannels > max_channels) return std::to_string(spec.nchannels) + " channels";
  const std::int64_t row = std::max<std::int64_t>(std::int64_t{spec.width} * spec.nchannels, 1);
  if (std::min(spec.tile_height, spec.height) > max_values / row)
    return "tiles of " + std::to_string(spec.tile_height) + " rows";
  if (const int rows = spec.get_int_attribute("tiff:RowsPerStrip"); rows > max_values / row)
    return "strips of " + std::to_string(rows) + " rows";
  // OpenImageIO 2.4 writes their four inks into room for three colors.
  if (spec.tile_height > 0 && spec.get_string_attribute("tiff:ColorSpace") == "CMYK")
    return "CMYK inks in tiles";
  return "";
}

// Opens an image. Null where there is none that can be read; then `reason` says why, in one line.
inline std::unique_ptr<OIIO::ImageInput> open_image(const std::filesystem::path& path,
                                                    const OIIO::ImageSpec& hints,
                                                    std::string& reason) {
  std::string bytes(12, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  const std::string format = image_format(bytes, path.extension().string());
  if (format.empty()) {
    reason = std::string("it begins like none of ") + kImageFormats;
    return nullptr;
  }
  try {
    std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create(format);
    OIIO::ImageSpec spec;
    if (!input)
      reason = first_line(OIIO::geterror());
    else if (!input->open(path.string(), spec, hints))
      reason = first_line(input->geterror());
    else if (const std::string found = obstacle(spec); !found.empty())
      reason = "it has " + found + ", which cannot be read";
    else
      return input;
  } catch (const std::exception& error) {  // of a header that claims more pixels than fit memory
    reason = first_line(error.what());
  }
  return nullptr;
}

}  // namespace solidtex
