// solidtex-render: reads a scene, renders it, writes an EXR or a PNG.
#include <fmt/format.h>

#include <cstdio>
#include <optional>
#include <solidtex/pathtracer.hpp>

#include "tools/common/atomic_file.h"
#include "tools/common/cli.h"
#include "tools/common/progress.h"

namespace {

namespace fs = std::filesystem;
namespace pt = solidtex::pathtracer;
namespace tools = solidtex::tools;

constexpr const char* kExamples = R"(Examples:
  solidtex-render scenes/demo.json -o demo.png
  solidtex-render scene.json --spp 256 --size 1920,1080 -o scene.exr
  solidtex-render scene.json --spp 4 --force -o quick.png     a quick look

Options given here win over the scene's own "render" settings. The same scene, size, samples and
seed give the same picture, bit for bit, with any number of threads.
An EXR holds linear light; a PNG is brightened by the scene's exposure, clamped and sRGB-encoded.
The scene format is described in docs/scene-format.md.)";

struct Arguments {
  fs::path scene, output;
  std::vector<int> size;
  int samples = 0, threads = 0;
  std::uint64_t seed = 0;
  std::optional<pt::TextureFilter> texture_filter;
  bool force = false, quiet = false;
};

bool is_png(const fs::path& file) { return file.extension() == ".png"; }

// Before any work is done.
void check_output(const Arguments& arguments) {
  const fs::path& output = arguments.output;
  if (!is_png(output) && output.extension() != ".exr") {
    throw std::runtime_error(fmt::format("{}: found a file named *{}, expected *.png or *.exr",
                                         output.string(), output.extension().string()));
  }
  const fs::path folder = output.has_parent_path() ? output.parent_path() : ".";
  if (!fs::is_directory(folder)) {
    throw std::runtime_error(fmt::format("{}: found no folder {}, expected one to write into",
                                         output.string(), folder.string()));
  }
  tools::refuse_overwrite(output, arguments.force);
}

pt::RenderSettings choose_settings(const pt::Scene& scene, const Arguments& arguments,
                                   bool seed_given) {
  pt::RenderSettings settings = pt::settings_of(scene);
  if (!arguments.size.empty()) {
    settings.width = arguments.size[0];
    settings.height = arguments.size[1];
  }
  if (arguments.samples > 0) settings.samples = arguments.samples;
  if (seed_given) settings.seed = arguments.seed;
  if (arguments.texture_filter) settings.texture_filter = *arguments.texture_filter;
  settings.threads = arguments.threads;
  return settings;
}

pt::Image render_with_progress(const pt::Scene& scene, const pt::RenderSettings& settings,
                               bool quiet, pt::RenderStatistics& statistics) {
  const std::uint64_t total = static_cast<std::uint64_t>(settings.width) *
                              static_cast<std::uint64_t>(settings.height) *
                              static_cast<std::uint64_t>(settings.samples);
  std::optional<tools::Progress> progress;
  if (!quiet) progress.emplace("rendering", total);
  const auto on_samples = [&](std::uint64_t count) {
    if (progress) progress->advance(count);
  };
  try {
    pt::Image image = pt::render(scene, settings, {on_samples, tools::interrupted}, &statistics);
    if (progress) progress->finish();
    return image;
  } catch (const pt::Stopped&) {
    throw tools::Interrupted();
  }
}

void run(const Arguments& arguments, bool seed_given) {
  check_output(arguments);
  tools::install_interrupt_handler();
  const auto scene = pt::load_scene(arguments.scene);
  if (!arguments.quiet) {
    for (const std::string& note : pt::notes_of(*scene)) fmt::print("{}\n", note);
    std::fflush(stdout);
  }
  const pt::RenderSettings settings = choose_settings(*scene, arguments, seed_given);
  pt::RenderStatistics statistics;
  const pt::Image image = render_with_progress(*scene, settings, arguments.quiet, statistics);

  tools::AtomicFile output(arguments.output);
  if (is_png(arguments.output)) {
    pt::write_png(image, pt::exposure_of(*scene), output.temporary_path());
  } else {
    pt::write_exr(image, output.temporary_path());
  }
  output.commit();
  if (statistics.invalid_sample_count > 0) {
    fmt::print(stderr, "warning: {} samples were not finite and count as black\n",
               statistics.invalid_sample_count);
  }
  if (!arguments.quiet) {
    fmt::print(
        "{}: {} x {} pixels, {} samples each, {:.1f} million rays, {:.1f} million texture "
        "points\n",
        arguments.output.string(), settings.width, settings.height, settings.samples,
        static_cast<double>(statistics.ray_count) * 1e-6,
        static_cast<double>(statistics.texture_point_count) * 1e-6);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Renders a scene with solid textures into a picture.", "solidtex-render");
  Arguments arguments;
  app.add_option("scene", arguments.scene, "Scene file (JSON)")->required()->option_text("SCENE");
  app.add_option("-o,--output", arguments.output, "Picture to write, .exr or .png")->required();
  app.add_option("--spp", arguments.samples, "Samples per pixel")->check(CLI::Range(1, 1 << 20));
  app.add_option("--size", arguments.size, "Width and height in pixels")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::Range(1, 32768))
      ->option_text("W,H");
  CLI::Option* seed = app.add_option("--seed", arguments.seed, "Which noise the picture has");
  app.add_option("--threads", arguments.threads, "Threads (default: all)")
      ->check(CLI::Range(1, 1024));
  app.add_option("--texture-filter", arguments.texture_filter,
                 "What a sample takes of a solid texture: footprint, stochastic or none")
      ->transform(CLI::CheckedTransformer(pt::texture_filters()));
  app.add_flag("--force", arguments.force, "Overwrite the picture if it exists");
  app.add_flag("--quiet", arguments.quiet, "Say nothing but errors");
  app.footer(kExamples);
  return tools::run_tool(app, argc, argv, [&] { run(arguments, seed->count() > 0); });
}
