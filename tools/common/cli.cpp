#include "tools/common/cli.h"

#include <csignal>
#include <iostream>

namespace solidtex::tools {
namespace {

volatile std::sig_atomic_t interrupt_flag = 0;

void on_signal(int) { interrupt_flag = 1; }

}  // namespace

void install_interrupt_handler() {
  struct sigaction action = {};
  action.sa_handler = on_signal;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() { return interrupt_flag != 0; }

void throw_if_interrupted() {
  if (interrupted()) throw Interrupted();
}

void refuse_overwrite(const std::filesystem::path& path, bool force) {
  if (!force && std::filesystem::exists(std::filesystem::symlink_status(path)))
    throw std::runtime_error(path.string() + ": exists already (--force overwrites it)");
}

void add_precision(CLI::App& app, std::string& precision) {
  app.add_option("--precision", precision,
                 "full (default), or fast: sampler models only, almost all values within 1/255")
      ->check(CLI::IsMember({"full", "fast"}))
      ->type_name("full|fast");
}

int run_tool(CLI::App& app, int argc, char** argv, const std::function<void()>& work) {
  app.set_version_flag("--version", app.get_name() + " " + solidtex::version());
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? exit_success : exit_usage;
  }
  try {
    work();
    std::cout.flush();
    if (!std::cout) throw std::runtime_error("standard output: cannot write");
    return exit_success;
  } catch (const Interrupted& error) {
    std::cerr << app.get_name() << ": " << error.what() << '\n';
    return exit_interrupted;
  } catch (const std::exception& error) {
    std::cerr << app.get_name() << ": " << error.what() << '\n';
    return exit_failure;
  }
}

}  // namespace solidtex::tools
