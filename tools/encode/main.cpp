// solidtex-encode: turns a photograph into a model at once, with a texture space.
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "tools/common/cli.h"
#include "tools/common/output_file.h"
#include "tools/encode/nearest.h"
#include "tools/encode/photograph.h"

namespace {

namespace fs = std::filesystem;
using namespace solidtex::tools;

struct Options {
  fs::path photograph, output;
  std::string space, patches = "average", name, license, source;
  bool force = false;
};

constexpr char examples[] =
    "SPACE is the path of a .solidtex-space file, or the name of a shipped space.\n"
    "Examples:\n"
    "  solidtex-encode photo.jpg --space stones -o mine.solidtex\n"
    "  solidtex-encode photo.exr --space ./mine.solidtex-space -o mine.solidtex --force\n"
    "  solidtex-bake mine.solidtex --preview mine.png\n"
    "Exit code: 0 the model is written, 1 it is not, 2 wrong usage.";

void add_options(CLI::App& app, Options& options) {
  app.footer(examples);
  app.add_option("PHOTO", options.photograph, "Photograph: JPEG, PNG, TIFF, EXR ...")->required();
  app.add_option("--space", options.space, "Texture space: path, or name of a shipped one")
      ->required()
      ->type_name("SPACE");
  app.add_option("-o,--output", options.output, "Model to write, or - for standard output")
      ->required()
      ->type_name("OUT.solidtex");
  app.add_option("--patches", options.patches,
                 "Code of the photograph: average of its patches (default), or medoid, the patch "
                 "that is nearest to all others")
      ->check(one_of({"average", "medoid"}))
      ->type_name("average|medoid");
  app.add_option("--name", options.name, "Name of the material (default: that of the photograph)")
      ->type_name("NAME");
  app.add_option("--license", options.license, "License of the photograph, recorded in the model")
      ->type_name("SPDX");
  app.add_option("--source", options.source, "Source of the photograph, recorded in the model")
      ->type_name("TEXT");
  app.add_flag("--force", options.force, "Replace a file that exists");
}

void check_target(const Options& options) {
  if (lower_extension(options.output) != ".solidtex")
    throw std::runtime_error("-o " + options.output.string() +
                             ": expected a name that ends in .solidtex");
  check_output(options.output, {options.photograph, options.space}, options.force);
}

// The parts of the model's document that the space does not give.
std::string details(const Options& options) {
  nlohmann::ordered_json exemplar = {
      {"file", options.photograph.filename().string()},
      {"sha256", solidtex::file_sha256(options.photograph.string())}};
  if (!options.license.empty()) exemplar["license"] = options.license;
  if (!options.source.empty()) exemplar["source"] = options.source;
  const std::string stem = options.photograph.stem().string();
  const nlohmann::ordered_json document = {{"name", options.name.empty() ? stem : options.name},
                                           {"exemplar", exemplar},
                                           {"training", {{"patches", options.patches}}}};
  return document.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string training_advice(const Options& options) {
  return "A minute of training brings it closer: solidtex-train " + options.photograph.string() +
         " --space " + options.space + " --minutes 1 -o results/" +
         options.photograph.stem().string();
}

void print(const Nearest& nearest, const Options& options) {
  report("nearest", {{"name", nearest.name},
                     {"distance", nearest.distance},
                     {"own_median", nearest.own_median},
                     {"is_far", nearest.is_far()}});
  if (!is_json())
    std::fprintf(
        results(),
        "nearest material of the space: %s, distance %.3g (the space's own: median %.3g)\n",
        nearest.name.c_str(), nearest.distance, nearest.own_median);
  if (nearest.is_far())
    say("The space has seen nothing like it; the result resembles " + nearest.name +
        " more than the photograph.");
  say(training_advice(options));
}

void run(Options& options) {
  install_interrupt_handler();
  pipe_output(options.output, options.photograph.stem().string() + ".solidtex");
  check_target(options);
  const solidtex::space space(options.space);
  const Photograph photograph =
      read_photograph(options.photograph, 2 * space.resolution(), space.patch_size(),
                      ", or solidtex-train without --space");
  for (const std::string& note : photograph.notes) say(options.photograph.string() + ": " + note);
  const auto patches =
      options.patches == "medoid" ? SOLIDTEX_PATCHES_MEDOID : SOLIDTEX_PATCHES_AVERAGE;
  const solidtex::material material =
      space.encode(photograph.pixels, photograph.width, photograph.height, patches);
  throw_if_interrupted();
  const std::string document = details(options);
  write_completely(options.output, [&](const fs::path& file) {
    space.write_model(material, document, file.string());
  });
  report_file(options.output);
  print(find_nearest(space, material.code), options);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Turns a photograph into a model, with a texture space that has seen many materials.",
      "solidtex-encode");
  Options options;
  add_options(app, options);
  return run_tool(app, argc, argv, [&] { run(options); });
}
