#include "tools/render/job.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <chrono>
#include <solidtex/denoise.hpp>

#include "tools/common/cli.h"
#include "tools/common/output_file.h"
#include "tools/common/progress.h"
#include "tools/render/output.h"

namespace solidtex::tools {
namespace {

namespace fs = std::filesystem;
namespace pt = solidtex::pathtracer;

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

rusage usage() {
  rusage result{};
  getrusage(RUSAGE_SELF, &result);
  return result;
}

double processor_seconds() {
  const rusage used = usage();
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

void print_part(const char* name, double part, double total) {
  fmt::print(results(), "  {:<14}{:>9.2f} s {:>5.1f} %\n", name, part,
             total > 0 ? 100 * part / total : 0);
}

double per_second(double count, double time) { return time > 0 ? count / time * 1e-6 : 0; }

// Cost of a render since construction, for --stats.
class Profile {
 public:
  explicit Profile(std::uint64_t samples)
      : samples_(static_cast<double>(samples)),
        wall_(wall_seconds()),
        processor_(processor_seconds()) {}

  // Prints times, throughput and memory.
  void print(const pt::Scene& scene, const pt::RenderStatistics& statistics) const;

 private:
  double samples_, wall_, processor_;
};

void Profile::print(const pt::Scene& scene, const pt::RenderStatistics& statistics) const {
  const double wall = wall_seconds() - wall_, processor = processor_seconds() - processor_;
  const double known =
      statistics.intersection_seconds + statistics.texture_seconds + statistics.shading_seconds;
  fmt::print(results(), "rendering: {:.2f} s, {:.2f} s of processor time\n", wall, processor);
  print_part("intersection", statistics.intersection_seconds, processor);
  print_part("textures", statistics.texture_seconds, processor);
  print_part("shading", statistics.shading_seconds, processor);
  print_part("other", processor - known, processor);  // threads of texture queries, previews
  fmt::print(
      results(),
      "samples: {:.3f} million, {:.3f} million per second, {:.3f} million per processor second\n",
      samples_ * 1e-6, per_second(samples_, wall), per_second(samples_, processor));
  const auto rays = static_cast<double>(statistics.ray_count);
  fmt::print(results(), "rays: {:.2f} million, {:.2f} million per second of intersection\n",
             rays * 1e-6, per_second(rays, statistics.intersection_seconds));
  const auto points = static_cast<double>(statistics.texture_point_count);
  fmt::print(results(), "texture points: {:.2f} million, {:.3f} million per second of textures\n",
             points * 1e-6, per_second(points, statistics.texture_seconds));
  const pt::BrickStatistics bricks = pt::brick_statistics(scene);
  fmt::print(results(), "bricks: {} computed, {} needed, {:.1f} MiB peak\n", bricks.computed,
             bricks.needed, static_cast<double>(bricks.peak_bytes) / 0x1p20);
  fmt::print(results(), "memory: {:.1f} MiB peak\n", static_cast<double>(usage().ru_maxrss) / 1024);
}

// A periodic task.
class Alarm {
 public:
  explicit Alarm(double seconds) : seconds_(seconds) {}
  bool is_due() const { return seconds_.count() > 0 && Clock::now() - last_ > seconds_; }
  void reset() { last_ = Clock::now(); }
  void turn_off() { seconds_ = std::chrono::duration<double>(0); }

 private:
  using Clock = std::chrono::steady_clock;
  std::chrono::duration<double> seconds_;
  Clock::time_point last_ = Clock::now();
};

class Job {
 public:
  Job(const pt::Scene& scene, const Options& options, const fs::path& output)
      : scene_(scene),
        options_(options),
        output_(output),
        preview_(fs::path(output).replace_extension("preview.png")),
        display_(display_for(scene, options)),
        settings_(checked(settings_for(scene, options), output)),
        renderer_(scene, settings_),
        profile_(renderer_.remaining_samples()),
        preview_alarm_(options.preview_every),
        checkpoint_alarm_(has_checkpoint() ? options.checkpoint_every : 0) {}

  void run() {
    if (has_checkpoint() && fs::exists(options_.checkpoint)) resume();
    render();
    const std::string legend = write();
    std::error_code ignored;
    if (options_.preview_every > 0) fs::remove(preview_, ignored);
    if (has_checkpoint()) fs::remove(options_.checkpoint, ignored);
    report(legend);
  }

 private:
  static pt::RenderSettings checked(const pt::RenderSettings& settings, const fs::path& output) {
    check_room(settings, output);
    return settings;
  }

  bool has_checkpoint() const { return !options_.checkpoint.empty(); }

  void resume() {
    renderer_.resume(options_.checkpoint);
    say(options_.checkpoint.string() + ": resumed");
  }

  void render() {
    std::optional<Progress> progress;
    if (!is_quiet()) progress.emplace("rendering", renderer_.remaining_samples());
    pt::Callbacks callbacks;
    callbacks.on_samples = [&](std::uint64_t count) {
      if (progress) progress->advance(count);
    };
    callbacks.should_stop = [&] {
      return interrupted() || preview_alarm_.is_due() || checkpoint_alarm_.is_due();
    };
    while (!renderer_.render(callbacks)) {
      if (interrupted()) stop();
      if (preview_alarm_.is_due()) write_preview();
      if (checkpoint_alarm_.is_due()) write_checkpoint();
    }
    if (progress) progress->finish();
  }

  [[noreturn]] void stop() {
    if (!has_checkpoint()) throw Interrupted();
    save();
    throw Interrupted(options_.checkpoint.string() + " keeps the samples so far");
  }

  void save() {
    write_completely(options_.checkpoint, [&](const fs::path& file) { renderer_.save(file); });
  }

  // An error, a full disk for example, must not end the render.
  void write_checkpoint() {
    try {
      save();
    } catch (const std::exception& error) {
      fmt::print(stderr, "warning: {}\n", error.what());
    }
    checkpoint_alarm_.reset();
  }

  void write_preview() {
    try {
      write_image(renderer_.image(), display_, preview_);
      preview_alarm_.reset();
    } catch (const std::exception& error) {
      fmt::print(stderr, "warning: {}; previews are off\n", error.what());
      preview_alarm_.turn_off();
    }
  }

  // Saves an image elsewhere if it cannot be written, because the disk is full for example.
  std::string write() {
    pt::AovImage image = renderer_.image();
    try {
      if (options_.denoise) denoise(image);
      return write_image(image, display_, output_);
    } catch (const std::exception& error) {
      throw std::runtime_error(fmt::format("{}; {}", error.what(), rescue(image)));
    }
  }

  // Drops the AOVs that only guide the denoiser.
  void denoise(pt::AovImage& image) const {
    pt::denoise(image);
    const pt::AovSet wanted = aovs_to_write(options_);
    std::erase_if(image.planes,
                  [&](const pt::AovImage::Plane& plane) { return !wanted.has(plane.aov); });
  }

  std::string rescue(const pt::AovImage& image) {
    fs::path refuge = options_.checkpoint;
    try {
      if (has_checkpoint()) {
        save();
      } else {
        refuge = fs::temp_directory_path() / output_.filename().replace_extension("rescued.exr");
        refuse_overwrite(refuge, false);
        write_image(image, display_, refuge);
      }
    } catch (const std::exception& error) {
      return fmt::format("it cannot be saved elsewhere either: {}", error.what());
    }
    return refuge.string() + " keeps the render";
  }

  void report(const std::string& legend) const {
    const pt::RenderStatistics statistics = renderer_.statistics();
    if (statistics.invalid_sample_count > 0) {
      fmt::print(stderr, "warning: not finite, and black in the image: {}\n",
                 count_of(statistics.invalid_sample_count, "sample"));
    }
    if (options_.stats) profile_.print(scene_, statistics);
    if (is_quiet() && results() == stdout) return;
    std::string about =
        fmt::format(": {} x {} pixels, {}{} each, {}, {}", settings_.width, settings_.height,
                    settings_.noise > 0 ? "at most " : "",
                    count_of(static_cast<std::uint64_t>(settings_.samples), "sample"),
                    count_of(statistics.ray_count, "ray"),
                    count_of(statistics.texture_point_count, "texture point"));
    if (!legend.empty()) about += "\n" + legend;
    report_file(output_, about);
  }

  const pt::Scene& scene_;
  const Options& options_;
  const fs::path output_, preview_;
  const pt::Display display_;
  const pt::RenderSettings settings_;
  pt::Renderer renderer_;
  const Profile profile_;
  Alarm preview_alarm_, checkpoint_alarm_;
};

}  // namespace

void render_image(const pt::Scene& scene, const Options& options, const fs::path& output) {
  Job(scene, options, output).run();
}

}  // namespace solidtex::tools
