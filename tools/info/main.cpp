// solidtex-info: prints the contents of a model or a texture space and verifies it.
#include <algorithm>
#include <filesystem>
#include <iostream>

#include "tools/common/cli.h"
#include "tools/common/output_file.h"
#include "tools/info/report.h"

namespace {

using namespace solidtex::tools;

// A name, in place of a path, is that of a shipped model or of a shipped texture space.
nlohmann::ordered_json describe_file(const std::string& file) {
  const std::string extension = lower_extension(file);
  if (extension == ".solidtex-space") return describe(solidtex::space(file));
  const bool is_path = std::filesystem::path(file).has_parent_path() || extension == ".solidtex";
  if (!is_path && std::ranges::count(solidtex::model_names(), file) == 0) {
    try {
      return describe(solidtex::space(file));
    } catch (const solidtex::error& error) {
      if (error.status() != SOLIDTEX_IO_ERROR) throw;
    }  // no space has the name either: the message on models lists them
  }
  return describe(solidtex::texture(file));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Prints the contents of a model or texture space and verifies the whole file.",
               "solidtex-info");
  app.footer(
      "Examples:\n"
      "  solidtex-info granite-grey            a shipped model, by name\n"
      "  solidtex-info granite-grey --verbose  with its layers and the settings of its training\n"
      "  solidtex-info mine.solidtex --json    for scripts\n"
      "  solidtex-info mine.solidtex-space     a texture space\n"
      "  solidtex-info stones                  a shipped texture space, by name\n"
      "Exit code: 0 the file is valid, 1 it is not, 2 wrong usage.");
  std::string model;
  bool as_json = false;
  app.add_option("MODEL", model,
                 "Path of a .solidtex or .solidtex-space file, or name of a shipped one")
      ->required();
  app.add_flag("--json", as_json, "Print JSON instead of text");

  return run_tool(app, argc, argv, [&] {
    const auto report = describe_file(model);
    if (as_json)
      std::cout << to_text(report, 2) << '\n';
    else
      print(report, std::cout, is_verbose());
  });
}
