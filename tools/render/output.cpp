#include "tools/render/output.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>

#include "tools/common/atomic_file.h"
#include "tools/common/cli.h"

namespace solidtex::tools {
namespace {

namespace fs = std::filesystem;
namespace pt = solidtex::pathtracer;

bool is_png(const fs::path& file) { return file.extension() == ".png"; }

fs::path folder_of(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : ".";
}

void check_folder(const fs::path& file) {
  const fs::path folder = folder_of(file);
  if (!fs::is_directory(folder)) {
    throw std::runtime_error(fmt::format("{}: found no folder {}, expected one to write into",
                                         file.string(), folder.string()));
  }
  // Probes by writing: permissions do not tell that a file system is read-only or special.
  const AtomicFile probe(file);
  if (!std::ofstream(probe.temporary_path())) {
    throw std::runtime_error(fmt::format("{}: cannot write into the folder {}: {}", file.string(),
                                         folder.string(), std::strerror(errno)));
  }
}

std::string in_mebibytes(std::uintmax_t bytes) {
  return fmt::format("{:.1f} MiB", static_cast<double>(bytes) / (1 << 20));
}

std::size_t channel_count(const pt::AovSet& aovs) {
  std::size_t count = 0;
  for (const pt::AovInfo& aov : pt::all_aovs()) {
    if (aovs.has(aov.aov)) count += aov.channels.size();
  }
  return count;
}

}  // namespace

void check_output(const fs::path& output, const Options& options) {
  if (!is_png(output) && output.extension() != ".exr") {
    throw std::runtime_error(fmt::format("{}: found a file named *{}, expected *.png or *.exr",
                                         output.string(), output.extension().string()));
  }
  if (is_png(output) && !options.aovs.empty()) {
    throw std::runtime_error(
        fmt::format("{}: found --aovs (--layers) for a PNG, expected an EXR, or --view for one AOV",
                    output.string()));
  }
  check_folder(output);
  refuse_overwrite(output, options.force);
}

void check_checkpoint(const Options& options) {
  if (!options.checkpoint.empty()) check_folder(options.checkpoint);
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
  const auto memory = static_cast<std::uintmax_t>(sysconf(_SC_PHYS_PAGES)) *
                      static_cast<std::uintmax_t>(sysconf(_SC_PAGESIZE));
  if (needed > memory) {
    throw std::runtime_error(
        fmt::format("{}: found {} x {} pixels of {} channels, which need {} of memory, expected at "
                    "most {}, the "
                    "memory of this machine (--crop renders parts)",
                    output.string(), settings.width, settings.height, channels,
                    in_mebibytes(needed), in_mebibytes(memory)));
  }
  const std::uintmax_t size = pixels * (is_png(output) ? 3 : channels * sizeof(float));
  std::error_code unknown;
  const fs::space_info space = fs::space(folder_of(output), unknown);
  if (!unknown && space.available < size) {
    throw std::runtime_error(
        fmt::format("{}: found {} free on the disk, expected {}, the size of the image",
                    output.string(), in_mebibytes(space.available), in_mebibytes(size)));
  }
}

void write_completely(const fs::path& target, const std::function<void(const fs::path&)>& write) {
  AtomicFile file(target);
  const std::string temporary = file.temporary_path().string();
  try {
    write(file.temporary_path());
  } catch (const std::exception& error) {
    std::string message = error.what();
    const std::size_t place = message.find(temporary);
    if (place != std::string::npos) message.replace(place, temporary.size(), target.string());
    throw std::runtime_error(message);
  }
  file.commit();
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
