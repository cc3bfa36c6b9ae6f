#include "tools/encode/photograph.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <future>
#include <memory>
#include <stdexcept>
#include <utility>

#include "plugins/common/open_image.h"
#include "tools/common/cli.h"

namespace solidtex::tools {
namespace {

using OIIO::ImageInput;
using OIIO::ImageSpec;

constexpr std::int64_t max_values = std::int64_t{1} << 32;  // read in a minute or two
constexpr int max_elongation = 64;  // of sides, so that the reduced image has a few megapixels

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& found,
                         const std::string& expected) {
  throw std::runtime_error(path.string() + ": found " + found + ", expected " + expected);
}

std::unique_ptr<ImageInput> open(const std::filesystem::path& path) {
  std::error_code problem;
  const auto status = std::filesystem::status(path, problem);
  if (problem) throw std::runtime_error(path.string() + ": cannot read: " + problem.message());
  if (!std::filesystem::is_regular_file(status))
    throw std::runtime_error(path.string() + ": cannot read: not a regular file");
  std::string reason;
  auto input = open_image(path, ImageSpec(), reason);
  if (!input)
    refuse(path, "no readable image (" + reason + ")", "a photograph (JPEG, PNG, TIFF, EXR ...)");
  return input;
}

bool holds_cmyk(const ImageSpec& spec) {
  return std::ranges::any_of(spec.extra_attribs, [](const OIIO::ParamValue& attribute) {
    return attribute.name().string().ends_with(":ColorSpace") && attribute.get_string() == "CMYK";
  });
}

// Refuses what OpenImageIO would give colors of its own, as solidtex-train does
// (python_export/solidtex_export/images/file_kinds.py).
void check_header(const std::filesystem::path& path, const ImageSpec& spec) {
  const std::int64_t pixels = std::int64_t{spec.width} * spec.height;
  if (spec.width < 1 || spec.height < 1 || pixels > max_values / std::max(spec.nchannels, 1))
    refuse(path,
           std::to_string(spec.width) + " x " + std::to_string(spec.height) + " pixels of " +
               std::to_string(spec.nchannels) + " channels",
           "at most " + std::to_string(max_values / 1'000'000) + " million values in all");
  const auto [shorter, longer] = std::minmax(spec.width, spec.height);
  if (longer / max_elongation >= shorter)
    refuse(path, std::to_string(spec.width) + " x " + std::to_string(spec.height) + " pixels",
           "sides that differ by less than a factor of " + std::to_string(max_elongation) +
               "; crop it");
  const std::string developed = "a developed image (for example darktable-cli " +
                                path.filename().string() + " " + path.stem().string() +
                                ".tif, then take the .tif)";
  if (spec.depth > 1)
    refuse(path, "a volume of " + std::to_string(spec.depth) + " layers", "a flat image");
  if (spec.deep) refuse(path, "a deep image (several samples a pixel)", "a flattened one");
  if (spec.get_int_attribute("tiff:subfiletype") & 1)
    refuse(path, "a thumbnail, marked as a reduced copy of another image", developed);
  switch (spec.get_int_attribute("tiff:PhotometricInterpretation", -1)) {
    case 32803:  // color filter array
    case 34892:  // linear raw
      refuse(path, "a camera's raw data", developed);
    case 4:
      refuse(path, "a transparency mask", "an image");
    case 8:
    case 9:
    case 10:
      refuse(path, "CIE L*a*b* values", "RGB; convert it to sRGB first");
    default:
      break;
  }
  if (holds_cmyk(spec))
    refuse(path, "CMYK inks, whose colors depend on a printer",
           "RGB; convert it to sRGB with its color profile first");
}

// Refuses frames and pages. Opens the file again, because some formats cannot seek back.
void check_is_one_image(const std::filesystem::path& path) {
  const auto input = open(path);
  if (input->format_name() != std::string("openexr") && input->seek_subimage(1, 0))
    refuse(path, "several images (frames, pages or parts)",
           "a file with one (for example magick " + path.filename().string() + "[0] one.png)");
}

// Channels of the file that are used.
struct Channels {
  int color[3] = {0, 0, 0};  // gray: three times the same
  int alpha = -1;
};

int find_channel(const ImageSpec& spec, const std::string& name) {
  const auto found = std::ranges::find(spec.channelnames, name);
  return found == spec.channelnames.end() ? -1
                                          : static_cast<int>(found - spec.channelnames.begin());
}

Channels find_channels(const std::filesystem::path& path, const ImageSpec& spec) {
  Channels result;
  result.alpha = find_channel(spec, "A");
  const int others = spec.nchannels - (result.alpha >= 0 ? 1 : 0);
  bool has_color = true;
  for (int c = 0; c < 3; ++c) {
    result.color[c] = find_channel(spec, std::string(1, "RGB"[c]));
    has_color = has_color && result.color[c] >= 0;
  }
  if (has_color) return result;
  if (others == 1) {
    std::ranges::fill(result.color, result.alpha == 0 ? 1 : 0);
    return result;
  }
  std::string names;
  for (const std::string& name : spec.channelnames) names += (names.empty() ? "" : ", ") + name;
  refuse(path, "the channels " + names, "gray or R, G, B");
}

float srgb_encoded(float linear) {
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
}

// Averages blocks of `factor` x `factor` pixels, row after row. Columns and rows that fill no block
// are dropped half on each side.
class BlockAverage {
 public:
  BlockAverage(const std::filesystem::path& path, const ImageSpec& spec, std::size_t factor)
      : path_(path),
        spec_(spec),
        channels_(find_channels(path, spec)),
        is_linear_(spec.format.is_floating_point()),
        factor_(factor) {
    photograph_.width = static_cast<std::size_t>(spec.width) / factor;
    photograph_.height = static_cast<std::size_t>(spec.height) / factor;
    left_ = (static_cast<std::size_t>(spec.width) % factor) / 2;
    top_ = (static_cast<std::size_t>(spec.height) % factor) / 2;
    photograph_.pixels.resize(3 * photograph_.width * photograph_.height);
  }

  // Adds rows [first, first + count) of all channels.
  void add(std::size_t first, std::size_t count, const std::vector<float>& rows) {
    const auto columns = static_cast<std::size_t>(spec_.width);
    const auto stride = static_cast<std::size_t>(spec_.nchannels);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t row = first + i;
      const float* from = rows.data() + i * columns * stride;
      if (channels_.alpha >= 0) check_alpha(from, row);
      if (row < top_ || (row - top_) / factor_ >= photograph_.height) continue;
      add_row(from + left_ * stride, stride,
              photograph_.pixels.data() + 3 * photograph_.width * ((row - top_) / factor_));
    }
  }

  Photograph finish() {
    const float share = 1.0f / static_cast<float>(factor_ * factor_);
    for (float& value : photograph_.pixels) {
      value *= share;
      if (!std::isfinite(value)) refuse(path_, "values that are not finite", "finite ones");
    }
    return std::move(photograph_);
  }

 private:
  void check_alpha(const float* pixels, std::size_t row) const {
    for (int x = 0; x < spec_.width; ++x)
      if (pixels[x * spec_.nchannels + channels_.alpha] < 1)
        refuse(path_,
               "pixels that are not opaque (column " + std::to_string(x) + ", row " +
                   std::to_string(row) + ")",
               "an opaque image; crop it");
  }

  void add_row(const float* from, std::size_t stride, float* to) const {
    for (std::size_t block = 0; block < photograph_.width; ++block, to += 3)
      for (std::size_t k = 0; k < factor_; ++k, from += stride)
        for (int c = 0; c < 3; ++c) {
          const float value = from[channels_.color[c]];
          to[c] += is_linear_ ? srgb_encoded(value) : value;
        }
  }

  const std::filesystem::path& path_;
  const ImageSpec& spec_;
  Channels channels_;
  bool is_linear_;
  std::size_t factor_, left_ = 0, top_ = 0;
  Photograph photograph_;
};

// Turns and flips as the EXIF orientation says.
Photograph upright(Photograph image, int orientation) {
  if (orientation < 2 || orientation > 8) return image;
  const bool turned = orientation >= 5;
  const bool flip_x = orientation == 2 || orientation == 3 || orientation == 6 || orientation == 7;
  const bool flip_y = orientation == 3 || orientation == 4 || orientation == 7 || orientation == 8;
  Photograph result{turned ? image.height : image.width, turned ? image.width : image.height,
                    std::vector<float>(image.pixels.size()), std::move(image.notes)};
  for (std::size_t y = 0; y < result.height; ++y)
    for (std::size_t x = 0; x < result.width; ++x) {
      std::size_t column = flip_x ? result.width - 1 - x : x;
      std::size_t row = flip_y ? result.height - 1 - y : y;
      if (turned) std::swap(column, row);
      std::copy_n(image.pixels.data() + 3 * (row * image.width + column), 3,
                  result.pixels.data() + 3 * (y * result.width + x));
    }
  return result;
}

// Reads rows in strips; a strip is reduced while the next one is decoded.
Photograph read_strips(const std::filesystem::path& path, ImageInput& input, const ImageSpec& spec,
                       std::size_t factor) {
  BlockAverage average(path, spec, factor);
  const int strip = strip_height(spec);
  std::vector<float> read, given;
  std::future<void> work;
  for (int y = 0; y < spec.height; y += strip) {
    throw_if_interrupted();
    const int count = std::min(strip, spec.height - y);
    const int top = spec.y + y;
    if (const auto error = read_rows(input, spec, 0, top, top + count, 0, spec.nchannels, read))
      refuse(path, "a damaged or unfinished image (" + *error + ")", "a whole one");
    if (work.valid()) work.get();
    std::swap(read, given);
    work = std::async(std::launch::async, [&average, &given, y, count] {
      average.add(static_cast<std::size_t>(y), static_cast<std::size_t>(count), given);
    });
  }
  if (work.valid()) work.get();
  return average.finish();
}

void note_color_profile(const ImageSpec& spec, std::vector<std::string>& notes) {
  const std::string profile = spec.get_string_attribute("ICCProfile:profile_description");
  if (!profile.empty() && profile.find("sRGB") == std::string::npos)
    notes.push_back("reads its color profile \"" + profile + "\" as sRGB");
}

bool is_of_one_color(const std::vector<float>& pixels) {
  return std::equal(pixels.begin() + 3, pixels.end(), pixels.begin());
}

}  // namespace

Photograph read_photograph(const std::filesystem::path& path, std::size_t least_side,
                           std::size_t patch, const std::string& otherwise) {
  const auto input = open(path);
  const ImageSpec spec = input->spec();
  check_header(path, spec);
  check_is_one_image(path);
  const auto side = static_cast<std::size_t>(std::min(spec.width, spec.height));
  if (side < patch)
    refuse(path, std::to_string(spec.width) + " x " + std::to_string(spec.height) + " pixels",
           "at least " + std::to_string(patch) + " x " + std::to_string(patch) +
               ", a patch of the encoder: use a larger photograph" + otherwise);
  const std::size_t factor = std::max<std::size_t>(1, side / least_side);
  Photograph result = read_strips(path, *input, spec, factor);
  if (is_of_one_color(result.pixels))
    refuse(path, "the same color everywhere", "an image that shows structure");
  note_color_profile(spec, result.notes);
  return upright(std::move(result), spec.get_int_attribute("Orientation", 1));
}

}  // namespace solidtex::tools
