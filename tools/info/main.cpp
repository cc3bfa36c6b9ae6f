// solidtex-info: prints the contents of a model or a texture space and checks its structure.
#include <filesystem>
#include <iostream>

#include "tools/common/cli.h"
#include "tools/common/output_file.h"
#include "tools/info/report.h"

namespace {

using namespace solidtex::tools;

// A name, in place of a path, is that of a shipped model or of a shipped texture space.
nlohmann::ordered_json describe_file(const std::string& file) {
  if (lower_extension(file) == ".solidtex-space") return describe(solidtex::space(file));
  const std::filesystem::path path(file);
  const bool is_name = !path.has_parent_path() && !path.has_extension();
  try {
    return describe(solidtex::texture(file));
  } catch (const solidtex::error& no_model) {
    if (!is_name || no_model.status() != SOLIDTEX_IO_ERROR) throw;
    try {
      return describe(solidtex::space(file));
    } catch (const solidtex::error& no_space) {
      if (no_space.status() != SOLIDTEX_IO_ERROR) throw;
    }
    throw;  // the message on models lists their names
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Prints the contents of a model or texture space and checks its whole structure.",
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
