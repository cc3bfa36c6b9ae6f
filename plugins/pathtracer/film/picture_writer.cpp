// EXR and PNG, by OpenImageIO.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <solidtex/picture.hpp>
#include <stdexcept>

#include "plugins/pathtracer/film/written_file.h"

namespace solidtex::pathtracer {
namespace {

// Encodes in memory: OpenEXR finishes files in a destructor, where a full disk goes unnoticed.
void write(const OIIO::ImageSpec& spec, const char* format, OIIO::TypeDesc type, const void* pixels,
           const std::filesystem::path& file) {
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
  close_written(stream, file);
}

std::size_t channel_count(const Picture& picture) {
  std::size_t count = 0;
  for (const auto& plane : picture.planes) count += info(plane.layer).channels.size();
  return count;
}

// All layers' channels side by side.
std::vector<float> interleave(const Picture& picture) {
  const std::size_t pixels = picture.window.pixel_count(), all = channel_count(picture);
  std::vector<float> values(pixels * all);
  std::size_t first = 0;
  for (const auto& plane : picture.planes) {
    const std::size_t channels = info(plane.layer).channels.size();
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

void write_exr(const Picture& picture, const std::filesystem::path& file) {
  const Window& window = picture.window;
  OIIO::ImageSpec spec(window.width(), window.height(), static_cast<int>(channel_count(picture)),
                       OIIO::TypeDesc::FLOAT);
  spec.x = window.x0, spec.y = window.y0;
  spec.full_width = picture.width, spec.full_height = picture.height;
  spec.channelnames.clear();
  for (const auto& plane : picture.planes) {
    const auto& names = info(plane.layer).channels;
    spec.channelnames.insert(spec.channelnames.end(), names.begin(), names.end());
  }
  spec.attribute("compression", "zip");
  spec.attribute("oiio:ColorSpace", "Linear");
  spec.attribute("DateTime", "");  // else the time, and no two files were alike
  write(spec, "openexr", OIIO::TypeDesc::FLOAT, interleave(picture).data(), file);
}

void write_exr(const Image& image, const std::filesystem::path& file) {
  write_exr(Picture{image.width,
                    image.height,
                    {0, 0, image.width, image.height},
                    {{Layer::beauty, image.rgb}}},
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
