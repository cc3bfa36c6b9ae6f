#include "tools/render/job.h"

#include <fmt/format.h>

#include <chrono>

#include "tools/common/cli.h"
#include "tools/common/progress.h"
#include "tools/render/output.h"
#include "tools/render/profile.h"

namespace solidtex::tools {
namespace {

namespace fs = std::filesystem;
namespace pt = solidtex::pathtracer;

// Something to do every so many seconds.
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
        rendering_(scene, settings_),
        profile_(rendering_.samples_left()),
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
    rendering_.resume(options_.checkpoint);
    if (!options_.quiet) fmt::print("{}: goes on from there\n", options_.checkpoint.string());
  }

  void render() {
    std::optional<Progress> progress;
    if (!options_.quiet) progress.emplace("rendering", rendering_.samples_left());
    pt::Hooks hooks;
    hooks.on_samples = [&](std::uint64_t count) {
      if (progress) progress->advance(count);
    };
    hooks.should_stop = [&] {
      return interrupted() || preview_alarm_.is_due() || checkpoint_alarm_.is_due();
    };
    while (!rendering_.go_on(hooks)) {
      if (interrupted()) stop();
      if (preview_alarm_.is_due()) write_preview();
      if (checkpoint_alarm_.is_due()) write_checkpoint();
    }
    if (progress) progress->finish();
  }

  [[noreturn]] void stop() {
    if (!has_checkpoint()) throw Interrupted();
    save();
    throw Interrupted(options_.checkpoint.string() + " keeps what is done");
  }

  void save() {
    write_completely(options_.checkpoint, [&](const fs::path& file) { rendering_.save(file); });
  }

  // What goes wrong on the way, a full disk say, must not cost the render.
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
      write_picture(rendering_.picture(), display_, preview_);
      preview_alarm_.reset();
    } catch (const std::exception& error) {
      fmt::print(stderr, "warning: {}; no more previews\n", error.what());
      preview_alarm_.turn_off();
    }
  }

  // A picture that cannot be written where it should be, because the disk is full say, is kept.
  std::string write() {
    const pt::Picture picture = rendering_.picture();
    try {
      return write_picture(picture, display_, output_);
    } catch (const std::exception& error) {
      throw std::runtime_error(fmt::format("{}; {}", error.what(), keep(picture)));
    }
  }

  std::string keep(const pt::Picture& picture) {
    fs::path refuge = options_.checkpoint;
    try {
      if (has_checkpoint()) {
        save();
      } else {
        refuge = fs::temp_directory_path() / output_.filename().replace_extension("rescued.exr");
        refuse_overwrite(refuge, false);
        write_picture(picture, display_, refuge);
      }
    } catch (const std::exception& error) {
      return fmt::format("nor can the render be kept in {}", error.what());
    }
    return refuge.string() + " keeps the render";
  }

  void report(const std::string& legend) const {
    const pt::RenderStatistics statistics = rendering_.statistics();
    if (statistics.invalid_sample_count > 0) {
      fmt::print(stderr, "warning: {} samples were not finite and count as black\n",
                 statistics.invalid_sample_count);
    }
    if (options_.stats) profile_.print(scene_, statistics);
    if (options_.quiet) return;
    fmt::print(
        "{}: {} x {} pixels, {}{} samples each, {:.1f} million rays, {:.1f} million texture "
        "points\n",
        output_.string(), settings_.width, settings_.height, settings_.noise > 0 ? "at most " : "",
        settings_.samples, static_cast<double>(statistics.ray_count) * 1e-6,
        static_cast<double>(statistics.texture_point_count) * 1e-6);
    if (!legend.empty()) fmt::print("{}\n", legend);
  }

  const pt::Scene& scene_;
  const Options& options_;
  const fs::path output_, preview_;
  const pt::Display display_;
  const pt::RenderSettings settings_;
  pt::Rendering rendering_;
  const Profile profile_;
  Alarm preview_alarm_, checkpoint_alarm_;
};

}  // namespace

void render_picture(const pt::Scene& scene, const Options& options, const fs::path& output) {
  Job(scene, options, output).run();
}

}  // namespace solidtex::tools
