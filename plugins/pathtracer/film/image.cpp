// AOVs of an image, and image files written by OpenImageIO.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <solidtex/image.hpp>
#include <stdexcept>

#include "plugins/pathtracer/film/output_stream.h"

namespace solidtex::pathtracer {
namespace {

// Encodes in memory: OpenEXR completes files in a destructor, which hides a full disk.
void write(const OIIO::ImageSpec& spec, const char* format, const OIIO::TypeDesc& type,
           const void* pixels, const std::filesystem::path& file) {
  const auto output = OIIO::ImageOutput::create(format);
  OIIO::Filesystem::IOVecOutput encoded;
  if (!output || !output->set_ioproxy(&encoded) || !output->open(file.string(), spec) ||
      !output->write_image(type, pixels) || !output->close()) {
    throw std::runtime_error(file.string() + ": cannot be encoded (" +
                             (output ? output->geterror() : OIIO::geterror()) + ")");
  }
  std::ofstream stream(file, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(encoded.buffer().data()),
               static_cast<std::streamsize>(encoded.buffer().size()));
  close_or_throw(stream, file);
}

std::size_t channel_count(const AovImage& image) {
  std::size_t count = 0;
  for (const auto& plane : image.planes) count += info(plane.aov).channels.size();
  return count;
}

// Interleaves the channels of all AOVs.
std::vector<float> interleave(const AovImage& image) {
  const std::size_t pixels = image.window.pixel_count(), all = channel_count(image);
  std::vector<float> values(pixels * all);
  std::size_t first = 0;
  for (const auto& plane : image.planes) {
    const std::size_t channels = info(plane.aov).channels.size();
    for (std::size_t i = 0; i < pixels; ++i) {
      for (std::size_t c = 0; c < channels; ++c) {
        values[i * all + first + c] = plane.values[i * channels + c];
      }
    }
    first += channels;
  }
  return values;
}

}  // namespace

const std::vector<AovInfo>& all_aovs() {
  static const std::vector<AovInfo> aovs = {
      {Aov::beauty, "beauty", {"R", "G", "B"}},
      {Aov::albedo, "albedo", {"albedo.R", "albedo.G", "albedo.B"}},
      {Aov::normal, "normal", {"normal.X", "normal.Y", "normal.Z"}},
      {Aov::depth, "depth", {"depth.Z"}},
      {Aov::position, "position", {"position.X", "position.Y", "position.Z"}},
      {Aov::texcoord, "texcoord", {"texcoord.X", "texcoord.Y", "texcoord.Z"}},
      {Aov::footprint, "footprint", {"footprint.radius"}},
      {Aov::cost, "cost", {"cost.points"}},
      {Aov::variance, "variance", {"variance.R", "variance.G", "variance.B"}},
      {Aov::samples, "samples", {"samples.count"}}};
  return aovs;
}

const std::vector<float>& AovImage::values(Aov aov) const {
  for (const Plane& plane : planes) {
    if (plane.aov == aov) return plane.values;
  }
  throw std::out_of_range("the image has no AOV " + info(aov).name);
}

Image beauty(const AovImage& image) {
  return {image.window.width(), image.window.height(), image.values(Aov::beauty)};
}

void write_exr(const AovImage& image, const std::filesystem::path& file) {
  const Window& window = image.window;
  OIIO::ImageSpec spec(window.width(), window.height(), static_cast<int>(channel_count(image)),
                       OIIO::TypeDesc::FLOAT);
  spec.x = window.x0, spec.y = window.y0;
  spec.full_width = image.width, spec.full_height = image.height;
  spec.channelnames.clear();
  for (const auto& plane : image.planes) {
    const auto& names = info(plane.aov).channels;
    spec.channelnames.insert(spec.channelnames.end(), names.begin(), names.end());
  }
  spec.attribute("compression", "zip");
  spec.attribute("oiio:ColorSpace", "Linear");
  spec.attribute("DateTime", "");  // otherwise two equal images give different files
  write(spec, "openexr", OIIO::TypeDesc::FLOAT, interleave(image).data(), file);
}

void write_exr(const Image& image, const std::filesystem::path& file) {
  write_exr(
      AovImage{
          image.width, image.height, {0, 0, image.width, image.height}, {{Aov::beauty, image.rgb}}},
      file);
}

void write_png(const Image& encoded, const std::filesystem::path& file) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(encoded.rgb.size());
  for (const float value : encoded.rgb) {
    bytes.push_back(static_cast<std::uint8_t>(std::lround(value * 255)));
  }
  OIIO::ImageSpec spec(encoded.width, encoded.height, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  write(spec, "png", OIIO::TypeDesc::UINT8, bytes.data(), file);
}

}  // namespace solidtex::pathtracer
