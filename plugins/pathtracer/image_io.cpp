#include "plugins/pathtracer/image_io.h"

#include <Imath/half.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenImageIO/imageio.h>

#include <cmath>
#include <cstdint>

#include "plugins/pathtracer/textures.h"

namespace solidtex::pathtracer {
namespace {

constexpr int kMaxImageSize = 32768;

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& found,
                         const std::string& expected) {
  throw SceneError(file.string() + ": found " + found + ", expected " + expected);
}

std::vector<float> read_pixels(OIIO::ImageInput& input, const std::filesystem::path& file) {
  const OIIO::ImageSpec& spec = input.spec();
  if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.width > kMaxImageSize ||
      spec.height > kMaxImageSize) {
    refuse(file, std::to_string(spec.width) + " x " + std::to_string(spec.height) + " pixels",
           "a flat image of at most " + std::to_string(kMaxImageSize) + " pixels a side");
  }
  std::vector<float> values(static_cast<std::size_t>(spec.width) *
                            static_cast<std::size_t>(spec.height) *
                            static_cast<std::size_t>(spec.nchannels));
  if (!input.read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, values.data())) {
    refuse(file, "an image that cannot be read (" + input.geterror() + ")", "a complete image");
  }
  return values;
}

float encode_channel(float linear) {
  return std::isfinite(linear) ? linear_to_srgb(glm::vec3(glm::clamp(linear, 0.0f, 1.0f))).x : 0;
}

}  // namespace

ColorImage read_image(const std::filesystem::path& file, ImageEncoding encoding) {
  if (!std::filesystem::exists(file)) refuse(file, "no such file", "an image");
  const auto input = OIIO::ImageInput::open(file.string());
  if (!input) refuse(file, "a file that is no image (" + OIIO::geterror() + ")", "an image");
  const OIIO::ImageSpec spec = input->spec();
  const std::vector<float> values = read_pixels(*input, file);
  const bool decode = encoding == ImageEncoding::srgb ||
                      (encoding == ImageEncoding::automatic && !spec.format.is_floating_point());
  const auto channel_count = static_cast<std::size_t>(spec.nchannels);

  ColorImage image{file.string(), spec.width, spec.height, {}};
  image.pixels.reserve(values.size() / channel_count);
  for (std::size_t i = 0; i < values.size(); i += channel_count) {
    // One or two channels are grey, with alpha or not.
    const glm::vec3 pixel = channel_count >= 3 ? glm::vec3(values[i], values[i + 1], values[i + 2])
                                               : glm::vec3(values[i]);
    for (int c = 0; c < 3; ++c) {
      if (!std::isfinite(pixel[c]) || pixel[c] < 0) {
        refuse(file, "a pixel with the value " + std::to_string(pixel[c]),
               "finite values, not below 0");
      }
    }
    image.pixels.push_back(decode ? srgb_to_linear(pixel) : pixel);
  }
  return image;
}

void write_exr(const Image& image, const std::filesystem::path& file) {
  Imf::Header header(image.width, image.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer frame_buffer;
  const std::size_t pixel_bytes = 3 * sizeof(float);
  const char* names[] = {"R", "G", "B"};
  for (std::size_t c = 0; c < 3; ++c) {
    header.channels().insert(names[c], Imf::Channel(Imf::FLOAT));
    // OpenEXR's slices are not const, but an output file only reads them.
    auto* base = reinterpret_cast<char*>(const_cast<float*>(image.rgb.data() + c));
    frame_buffer.insert(names[c], Imf::Slice(Imf::FLOAT, base, pixel_bytes,
                                             pixel_bytes * static_cast<std::size_t>(image.width)));
  }
  Imf::OutputFile output(file.c_str(), header);
  output.setFrameBuffer(frame_buffer);
  output.writePixels(image.height);
}

void write_png(const Image& image, float exposure, const std::filesystem::path& file) {
  const float factor = std::exp2(exposure);
  std::vector<std::uint8_t> bytes;
  bytes.reserve(image.rgb.size());
  for (const float value : image.rgb) {
    bytes.push_back(static_cast<std::uint8_t>(std::lround(encode_channel(value * factor) * 255)));
  }
  const auto output = OIIO::ImageOutput::create("png");
  OIIO::ImageSpec spec(image.width, image.height, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  if (!output || !output->open(file.string(), spec) ||
      !output->write_image(OIIO::TypeDesc::UINT8, bytes.data()) || !output->close()) {
    throw std::runtime_error(file.string() + ": cannot be written (" +
                             (output ? output->geterror() : OIIO::geterror()) + ")");
  }
}

}  // namespace solidtex::pathtracer
