// solidtex-mix: mixes materials of a texture space into a model.
#include "plugins/spaces/mixture.h"
#include "tools/common/cli.h"
#include "tools/common/output_file.h"
#include "tools/mix/options.h"

namespace solidtex::tools {
namespace {

void write(const spaces::Mixture& mixture, const Frame& frame) {
  const std::string details = mixture.details(frame.output.stem().string(), frame.weights);
  const solidtex::material material = mixture.blend(frame.weights);
  write_completely(frame.output, [&](const std::filesystem::path& file) {
    mixture.space().write_model(material, details, file.string());
  });
}

void mix(MixOptions& options) {
  pipe_output(options.output, "mixture.solidtex");
  const std::vector<Frame> frames = frames_of(options);
  for (const Frame& frame : frames)
    check_output(frame.output, {options.inputs.begin(), options.inputs.end()}, options.force);
  const spaces::Mixture mixture(options.inputs, options.space);
  for (const Frame& frame : frames) {
    throw_if_interrupted();
    write(mixture, frame);
    report_file(frame.output);
  }
}

}  // namespace
}  // namespace solidtex::tools

int main(int argc, char** argv) {
  using namespace solidtex::tools;
  CLI::App app("Mixes materials of a texture space into a .solidtex model, or a walk of models.",
               "solidtex-mix");
  MixOptions options;
  add_options(app, options);
  install_interrupt_handler();
  return run_tool(app, argc, argv, [&] { mix(options); });
}
