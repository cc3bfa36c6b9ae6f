#include "plugins/pathtracer/reader/image_reader.h"

#include <OpenImageIO/imageio.h>

#include <cmath>

#include "plugins/pathtracer/scene/color.h"

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

}  // namespace solidtex::pathtracer
