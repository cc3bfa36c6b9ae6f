#include "plugins/pathtracer/reader/image_reader.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "plugins/common/open_image.h"
#include "plugins/mesh/mesh.h"
#include "plugins/pathtracer/reader/color_layer.h"
#include "plugins/pathtracer/scene/color.h"

namespace solidtex::pathtracer {
namespace {

constexpr int kMaxImageSize = 32768;
// Relative to the largest value: what resampling filters leave beside bright pixels.
constexpr float kMaxUndershoot = 0.1f;
// Largest fraction of color values above 1 in an image of the range 0 to 1.
constexpr double kMaxOvershoots = 0.5;

template <class... Values>
std::string format(const char* pattern, Values... values) {
  char text[200];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

// An image file while it is read: refuses by its path, notes by its name.
class Reader {
 public:
  Reader(const std::filesystem::path& file, std::vector<std::string>& notes)
      : file_(file), notes_(notes) {
    check_content();
    OIIO::ImageSpec hints;
    hints.attribute("oiio:UnassociatedAlpha", 1);  // colors as stored, not multiplied by alpha
    std::string reason;
    input_ = open_image(file, hints, reason);
    if (!input_) refuse("a file that is no image (" + reason + ")", "an image");
    layer_ = find_color_layer(*input_, file, notes);
    check_colors();
    const OIIO::ImageSpec& s = layer_.spec;
    data_ = {s.x, s.y, s.x + s.width, s.y + s.height};
    display_ = data_;
    // Other formats use offsets for positions on paper.
    if (input_->format_name() == std::string("openexr")) {
      display_ = {s.full_x, s.full_y, s.full_x + s.full_width, s.full_y + s.full_height};
    }
  }

  ColorImage read(ImageEncoding encoding, ImageRange range) {
    check_size(data_);
    check_size(display_);
    std::vector<glm::vec3> pixels = read_pixels();
    check_finite(pixels);
    clamp_negatives(pixels);
    bool is_encoded = encoding == ImageEncoding::srgb;
    if (layer_.spec.format.is_floating_point()) {
      if (range == ImageRange::unit && scale_whole_numbers(pixels)) {
        is_encoded = encoding != ImageEncoding::linear;
      }
      if (range == ImageRange::unit) check_range(pixels);
    } else {
      is_encoded = encoding != ImageEncoding::linear;
      note_unused_range(pixels);
    }
    if (is_encoded) {
      for (glm::vec3& pixel : pixels) pixel = srgb_to_linear(pixel);
    }
    return fill_display_window(std::move(pixels));
  }

 private:
  [[noreturn]] void refuse(const std::string& found, const std::string& expected) const {
    throw SceneError(file_.string() + ": found " + found + ", expected " + expected);
  }
  void note(const std::string& text) { notes_.push_back(file_.filename().string() + ": " + text); }

  void check_content() const {
    if (!std::filesystem::exists(file_)) refuse("no such file", "an image");
    if (std::filesystem::is_directory(file_)) refuse("a folder", "an image");
    if (!std::filesystem::is_regular_file(file_)) refuse("no regular file", "an image");
    std::string begin(mesh::kOtherContentSize, '\0');
    std::ifstream stream(file_, std::ios::binary);
    stream.read(begin.data(), static_cast<std::streamsize>(begin.size()));
    begin.resize(static_cast<std::size_t>(stream.gcount()));
    if (const auto other = mesh::find_other_content(begin)) {
      refuse(other->found, "an image: " + other->remedy);
    }
  }

  // OpenImageIO takes for RGB what is not, and a thumbnail for the image.
  void check_colors() {
    constexpr int kReducedCopy = 1, kLab = 8, kItuLab = 10, kRaw = 32803, kLinearRaw = 34892;
    const OIIO::ImageSpec& spec = layer_.spec;
    const int photometric = spec.get_int_attribute("tiff:PhotometricInterpretation", -1);
    if (photometric >= kLab && photometric <= kItuLab) {
      refuse("CIE L*a*b* values", "RGB: convert it to sRGB first");
    }
    if (photometric == kRaw || photometric == kLinearRaw ||
        (spec.get_int_attribute("tiff:subfiletype", 0) & kReducedCopy)) {
      refuse(
          format("a camera's raw file or a thumbnail of %d x %d pixels", spec.width, spec.height),
          "a developed image (for example darktable-cli IN OUT.tif)");
    }
    for (const char* name : {"tiff:ColorSpace", "jpeg:ColorSpace"}) {
      if (spec.get_string_attribute(name) == "CMYK") {
        note("CMYK inks are converted to RGB without a color profile");
      }
    }
    if (const int turned = spec.get_int_attribute("Orientation", 1); turned != 1) {
      note(format("the pixels are taken as stored, not turned (orientation %d)", turned));
    }
  }

  void check_size(const Window& window) const {
    const OIIO::ImageSpec& s = layer_.spec;
    if (s.deep) refuse("a deep image", "a flat image");
    if (window.empty() || s.depth > 1 || window.width() > kMaxImageSize ||
        window.height() > kMaxImageSize) {
      refuse(format("%d x %d x %d pixels", window.width(), window.height(), std::max(s.depth, 1)),
             format("a flat image of at most %d pixels a side", kMaxImageSize));
    }
  }

  // The color channels of the data window. Notes an alpha channel that is not opaque. Memory grows
  // with what is read, not with what a header promises.
  std::vector<glm::vec3> read_pixels() {
    const int alpha = layer_.spec.alpha_channel;
    const auto [low, high] = std::ranges::minmax(layer_.channels);
    const int first = low, last = alpha == high + 1 ? alpha : high;
    const int strip = strip_height(layer_.spec);
    std::vector<float> values;
    std::vector<glm::vec3> pixels;
    bool is_opaque = true;
    input_->geterror();  // of looking for further parts
    for (int y = data_.y0; y < data_.y1; y += strip) {
      const int end = std::min(y + strip, data_.y1);
      if (const auto error =
              read_rows(*input_, layer_.spec, layer_.part, y, end, first, last + 1, values)) {
        refuse("an image that cannot be read (" + *error + ")",
               "a complete image: copy or export it again");
      }
      const std::ptrdiff_t stride = last - first + 1;
      for (auto pixel = values.begin(); pixel != values.end(); pixel += stride) {
        glm::vec3& color = pixels.emplace_back();
        for (int c = 0; c < 3; ++c) color[c] = pixel[layer_.channels[std::size_t(c)] - first];
        is_opaque = is_opaque && (last != alpha || pixel[last - first] >= 1);
      }
    }
    if (!is_opaque) note("alpha is ignored");
    if (is_white_zero()) invert(pixels);
    return pixels;
  }

  // OpenImageIO inverts TIFF files whose white is zero at 8 bits only.
  bool is_white_zero() const {
    return layer_.spec.get_int_attribute("tiff:PhotometricInterpretation", 1) == 0 &&
           layer_.spec.format != OIIO::TypeDesc::UINT8;
  }
  void invert(std::vector<glm::vec3>& pixels) {
    for (glm::vec3& pixel : pixels) pixel = 1.0f - pixel;
    note("white is zero in this file; the values are inverted");
  }

  std::string position(std::size_t index) const {
    const auto width = static_cast<std::size_t>(data_.width());
    return format("(%d, %d)", data_.x0 + static_cast<int>(index % width),
                  data_.y0 + static_cast<int>(index / width));
  }

  void check_finite(const std::vector<glm::vec3>& pixels) const {
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      for (int c = 0; c < 3; ++c) {
        if (!std::isfinite(pixels[i][c])) {
          refuse(format("the value %g", pixels[i][c]) + " in pixel " + position(i),
                 "finite values");
        }
      }
    }
  }

  void clamp_negatives(std::vector<glm::vec3>& pixels) {
    float min = 0, max = 0;
    std::size_t count = 0, worst = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      for (int c = 0; c < 3; ++c) {
        float& value = pixels[i][c];
        max = std::max(max, value);
        if (value >= 0) continue;
        if (value < min) min = value, worst = i;
        value = 0;
        ++count;
      }
    }
    if (count == 0) return;
    if (-min > kMaxUndershoot * max) {
      refuse(format("the value %g", min) + " in pixel " + position(worst),
             format("values not below 0 (up to %g %% of the largest value, %g, they are clamped)",
                    100 * kMaxUndershoot, max));
    }
    note(format("%zu values below 0, the smallest %g, are clamped to 0", count, min));
  }

  // Whole numbers up to 255 or 65535 that a program stored as floats.
  bool scale_whole_numbers(std::vector<glm::vec3>& pixels) {
    float max = 0;
    for (const glm::vec3& pixel : pixels) {
      if (pixel != glm::floor(pixel)) return false;
      max = std::max({max, pixel.x, pixel.y, pixel.z});
    }
    if (max < 16 || max > 65535) return false;
    const float scale = max <= 255 ? 255 : 65535;
    for (glm::vec3& pixel : pixels) pixel /= scale;
    note(format("whole numbers up to %g, stored as floats, are divided by %g", max, scale));
    return true;
  }

  void check_range(const std::vector<glm::vec3>& pixels) {
    float max = 0;
    std::size_t count = 0;
    for (const glm::vec3& pixel : pixels) {
      for (int c = 0; c < 3; ++c) {
        max = std::max(max, pixel[c]);
        count += pixel[c] > 1;
      }
    }
    if (count == 0) return;
    const double fraction = static_cast<double>(count) / (3 * static_cast<double>(pixels.size()));
    if (fraction > kMaxOvershoots) {
      refuse(format("float values up to %g, %.0f %% of them above 1", max, 100 * fraction),
             format("values from 0 to 1 (scale them: oiiotool IN --divc %g -o OUT)", max));
    }
    note(format("%.2g %% of the values exceed 1, the largest is %g; they are clamped",
                100 * fraction, max));
  }

  // Integers that use a small part of their range look black: 12 bits in 16, labels.
  void note_unused_range(const std::vector<glm::vec3>& pixels) {
    float max = 0;
    for (const glm::vec3& pixel : pixels) max = std::max({max, pixel.x, pixel.y, pixel.z});
    if (max <= 0 || max >= 1.0f / 15) return;
    const OIIO::TypeDesc type = layer_.spec.format;
    const int bits = 8 * static_cast<int>(type.size()) - (type.is_signed() ? 1 : 0);
    const double full = std::exp2(bits) - 1;
    note(
        format("the largest value is %.0f of %.0f, nearly black (to scale: oiiotool IN --mulc %g "
               "-o OUT)",
               std::round(max * full), full, 1 / static_cast<double>(max)));
  }

  ColorImage fill_display_window(std::vector<glm::vec3> pixels) {
    if (data_ == display_)
      return {file_.string(), data_.width(), data_.height(), std::move(pixels)};
    ColorImage image{file_.string(), display_.width(), display_.height(), {}};
    image.pixels.resize(display_.pixel_count(), glm::vec3(0));
    const Window common{std::max(data_.x0, display_.x0), std::max(data_.y0, display_.y0),
                        std::min(data_.x1, display_.x1), std::min(data_.y1, display_.y1)};
    if (common.empty()) refuse("a data window outside the display window", "an overlap");
    const auto index = [](const Window& window, int x, int y) {
      return static_cast<std::ptrdiff_t>(y - window.y0) * window.width() + (x - window.x0);
    };
    for (int y = common.y0; y < common.y1; ++y) {
      std::copy_n(pixels.begin() + index(data_, common.x0, y), common.width(),
                  image.pixels.begin() + index(display_, common.x0, y));
    }
    if (common.pixel_count() < display_.pixel_count()) {
      note(format("the data window covers %d x %d of %d x %d pixels; the others are black",
                  common.width(), common.height(), display_.width(), display_.height()));
    }
    return image;
  }

  const std::filesystem::path& file_;
  std::vector<std::string>& notes_;
  std::unique_ptr<OIIO::ImageInput> input_;
  ColorLayer layer_;
  Window data_, display_;
};

}  // namespace

ColorImage read_image(const std::filesystem::path& file, ImageEncoding encoding, ImageRange range,
                      std::vector<std::string>& notes) {
  return Reader(file, notes).read(encoding, range);
}

}  // namespace solidtex::pathtracer
