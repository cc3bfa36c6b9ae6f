// solidtex-info: prints the contents of a model or a texture space and verifies it.
#include <iostream>

#include "tools/common/cli.h"
#include "tools/common/output_file.h"
#include "tools/info/report.h"

int main(int argc, char** argv) {
  CLI::App app("Prints the contents of a model or texture space and verifies the whole file.",
               "solidtex-info");
  app.footer(
      "Examples:\n"
      "  solidtex-info granite-grey            a shipped model, by name\n"
      "  solidtex-info granite-grey --verbose  with its layers and the settings of its training\n"
      "  solidtex-info mine.solidtex --json    for scripts\n"
      "  solidtex-info mine.solidtex-space     a texture space\n"
      "Exit code: 0 the file is valid, 1 it is not, 2 wrong usage.");
  std::string model;
  bool as_json = false;
  app.add_option("MODEL", model,
                 "Path of a .solidtex or .solidtex-space file, or name of a shipped model")
      ->required();
  app.add_flag("--json", as_json, "Print JSON instead of text");

  return solidtex::tools::run_tool(app, argc, argv, [&] {
    const bool is_space = solidtex::tools::lower_extension(model) == ".solidtex-space";
    const auto report = is_space ? solidtex::tools::describe(solidtex::space(model))
                                 : solidtex::tools::describe(solidtex::texture(model));
    if (as_json)
      std::cout << solidtex::tools::to_text(report, 2) << '\n';
    else
      solidtex::tools::print(report, std::cout, solidtex::tools::is_verbose());
  });
}
