#include "tools/bake/image.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cmath>
#include <stdexcept>

#include "tools/bake/output_file.h"

namespace solidtex::tools {
namespace {

// Encoded in memory first: OpenImageIO does not report every failed write to a file.
std::vector<unsigned char> encoded(const std::filesystem::path& path, const OIIO::ImageSpec& spec,
                                   const Image& image) {
  const auto fail = [&](const std::string& reason) {
    throw std::runtime_error(path.string() + ": cannot encode: " + reason);
  };
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  const auto output = OIIO::ImageOutput::create(path.string());
  if (!output) fail(OIIO::geterror());
  output->set_ioproxy(&memory);
  if (!output->open(path.string(), spec) ||
      !output->write_image(OIIO::TypeDesc::FLOAT, image.values.data()) || !output->close())
    fail(output->geterror());
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

void write_bytes(const std::filesystem::path& path, std::span<const unsigned char> bytes) {
  OutputFile file(path);
  file.write(bytes.data(), bytes.size());
  file.close();
}

void write_png(const std::filesystem::path& path, const Image& image) {
  OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  write_bytes(path, encoded(path, spec, image));
}

void write_exr(const std::filesystem::path& path, const Image& image,
               const std::vector<std::string>& names) {
  OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeDesc::FLOAT);
  spec.channelnames = names;
  spec.attribute("compression", "zip");
  write_bytes(path, encoded(path, spec, image));
}

}  // namespace solidtex::tools
