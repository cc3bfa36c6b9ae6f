// solidtex-render: renders a scene to EXR or PNG images.
#include <fmt/core.h>

#include <solidtex/denoise.hpp>
#include <solidtex/pathtracer.hpp>

#include "tools/common/cli.h"
#include "tools/render/job.h"
#include "tools/render/options.h"
#include "tools/render/output.h"

namespace {

namespace pt = solidtex::pathtracer;
namespace tools = solidtex::tools;

void print_notes(const pt::Scene& scene) {
  for (const std::string& note : pt::notes_of(scene)) tools::say(note);
}

void run(tools::Options& options) {
  tools::pipe_output(options.output, options.scene.stem().string() + ".png");
  tools::check_checkpoint(options);
  if (options.denoise) pt::check_denoiser();
  tools::install_interrupt_handler();
  pt::Sequence sequence = tools::open_sequence(options);
  if (options.turntable > 0) sequence.set_turntable(options.turntable);
  const auto frames = tools::frames_to_render(options, sequence.frame_count());
  for (const tools::Frame& frame : frames) tools::check_output(frame.output, options);
  if (frames.empty()) tools::say("all images exist");
  std::size_t written = 0;
  try {
    for (const tools::Frame& frame : frames) {
      tools::throw_if_interrupted();
      const pt::Scene& scene = sequence.frame(frame.number);
      if (written == 0) print_notes(scene);
      tools::render_image(scene, options, frame.output);
      ++written;
    }
  } catch (const tools::Interrupted&) {
    if (written == 0) throw;
    throw tools::Interrupted(
        fmt::format("{} of {} images were written: --resume goes on", written, frames.size()));
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Renders a scene with solid textures.", "solidtex-render");
  tools::Options options;
  tools::add_options(app, options);
  return tools::run_tool(app, argc, argv, [&] { run(options); });
}
