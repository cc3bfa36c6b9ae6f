#include "tools/render/output.h"

#include <fmt/format.h>

#include <cstdint>

#include "tools/common/limits.h"
#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

namespace fs = std::filesystem;
namespace pt = solidtex::pathtracer;

bool is_png(const fs::path& file) { return lower_extension(file) == ".png"; }

std::size_t channel_count(const pt::AovSet& aovs) {
  std::size_t count = 0;
  for (const pt::AovInfo& aov : pt::all_aovs()) {
    if (aovs.has(aov.aov)) count += aov.channels.size();
  }
  return count;
}

}  // namespace

void check_output(const fs::path& output, const Options& options) {
  if (!is_png(output) && lower_extension(output) != ".exr") {
    throw std::runtime_error(fmt::format("{}: found a file named *{}, expected *.png or *.exr",
                                         output.string(), output.extension().string()));
  }
  if (is_png(output) && !options.aovs.empty()) {
    throw std::runtime_error(
        fmt::format("{}: found --aovs (--layers) for a PNG, expected an EXR, or --view for one AOV",
                    output.string()));
  }
  check_output(output, {}, options.force);
}

void check_checkpoint(const Options& options) {
  if (!options.checkpoint.empty()) check_writable(options.checkpoint);
}

void check_room(const pt::RenderSettings& settings, const fs::path& output) {
  const std::size_t channels = channel_count(settings.aovs);
  std::uintmax_t pixels = settings.crop.pixel_count();
  if (settings.crop.empty()) {
    pixels =
        static_cast<std::uintmax_t>(settings.width) * static_cast<std::uintmax_t>(settings.height);
  }
  // Sums as doubles, then three copies as floats while writing.
  const std::uintmax_t needed = pixels * (channels * (sizeof(double) + 3 * sizeof(float)) + 16);
  check_memory(fmt::format("{}: an image of {} x {} pixels and {} channels", output.string(),
                           settings.width, settings.height, channels),
               static_cast<double>(needed), "--crop renders a part of it");
  const std::uintmax_t size = pixels * (is_png(output) ? 3 : channels * sizeof(float));
  check_disk(output, static_cast<double>(size), "");
}

std::string write_image(const pt::AovImage& image, const pt::Display& display,
                        const fs::path& output) {
  pt::Visualization view;
  if (is_png(output)) view = pt::visualize(image, image.planes.front().aov, display);
  write_completely(output, [&](const fs::path& file) {
    if (is_png(output)) {
      pt::write_png(view.encoded, file);
    } else {
      pt::write_exr(image, file);
    }
  });
  return view.legend;
}

}  // namespace solidtex::tools
