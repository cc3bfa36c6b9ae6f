#include "tools/bake/image.h"

#include <png.h>

#include <algorithm>
#include <cmath>

#include "tools/bake/encoding.h"
#include "tools/bake/exr_file.h"
#include "tools/bake/output_file.h"

// PNG and EXR by their own libraries, so that every failed write is noticed.
// OpenImageIO wrote them before: it brings 260 shared libraries along, 115 MiB and 0.15 s to load.
namespace solidtex::tools {
namespace {

using Bytes = std::vector<unsigned char>;

void write_bytes(const std::filesystem::path& path, const Bytes& bytes) {
  OutputFile file(path);
  file.write(0, bytes.data(), bytes.size());
  file.close();
}

Bytes encode_png(const std::filesystem::path& path, const Image& image) {
  std::vector<std::uint8_t> pixels(image.values.size());
  std::transform(image.values.begin(), image.values.end(), pixels.begin(), to_8_bits);
  png_image header = {};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width);
  header.height = static_cast<png_uint_32>(image.height);
  header.format = image.channels == 1 ? PNG_FORMAT_GRAY : PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(header);
  Bytes bytes(size);
  if (!png_image_write_to_memory(&header, bytes.data(), &size, 0, pixels.data(), 0, nullptr))
    throw WriteError(path, header.message);
  bytes.resize(size);
  return bytes;
}

}  // namespace

float srgb_to_linear(float value) {
  if (!(value > 0.04045f)) return value / 12.92f;
  return std::pow((value + 0.055f) / 1.055f, 2.4f);
}

float linear_to_srgb(float value) {
  if (!(value > 0.0031308f)) return value * 12.92f;
  return 1.055f * std::pow(value, 1 / 2.4f) - 0.055f;
}

void write_png(const std::filesystem::path& path, const Image& image) {
  write_bytes(path, encode_png(path, image));
}

void write_exr(const std::filesystem::path& path, const Image& image,
               const std::vector<std::string>& names) {
  ExrFile file(path, image.width, image.height, names);
  file.write_rows(image.values.data(), image.height);
  file.close();
}

}  // namespace solidtex::tools
