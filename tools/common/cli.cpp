#include "tools/common/cli.h"

#include <csignal>
#include <cstdio>
#include <iostream>
#include <new>
#include <nlohmann/json.hpp>
#include <vector>

#include "tools/common/completion.h"

namespace solidtex::tools {
namespace {

volatile std::sig_atomic_t interrupt_flag = 0;

// What the options of all tools say, and the files that were written.
struct Talk {
  bool quiet = false, verbose = false, json = false;
  std::vector<std::string> files;
} talk;

void add_talk(CLI::App& app) {
  const auto is_new = [&](const char* name) { return !app.get_option_no_throw(name); };
  if (is_new("--quiet")) app.add_flag("-q,--quiet", talk.quiet, "Print results and errors only");
  if (is_new("--verbose")) app.add_flag("-v,--verbose", talk.verbose, "Print more");
  if (is_new("--json")) {
    app.add_flag("--json", talk.json, "Print the results as JSON to standard output");
  }
  app.allow_config_extras(CLI::config_extras_mode::error);
  app.set_config("--config", "", "Read options from a TOML file; the command line goes first");
}

void print_json(const CLI::App& app) {
  if (!talk.json) return;
  const nlohmann::ordered_json document = {
      {"program", app.get_name()}, {"version", solidtex::version()}, {"files", talk.files}};
  std::cout << document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
}

void on_signal(int) { interrupt_flag = 1; }

constexpr char out_of_memory[] =
    "out of memory: the system gave no more; close other programs, raise `ulimit -v`, or make less "
    "at a time";

int fail(const CLI::App& app, const char* message, int exit_code = exit_failure) {
  std::cerr << app.get_name() << ": " << message << '\n';
  return exit_code;
}

}  // namespace

bool is_quiet() { return talk.quiet; }
bool is_verbose() { return talk.verbose; }
bool is_json() { return talk.json; }

void say(const std::string& text) {
  if (!is_quiet()) std::cerr << text << '\n';
}

void report_file(const std::filesystem::path& path) {
  talk.files.push_back(path.string());
  if (!is_json()) std::cout << path.string() << std::endl;
}

void install_interrupt_handler() {
  struct sigaction action = {};
  action.sa_handler = on_signal;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  struct sigaction of_hangup = {};
  sigaction(SIGHUP, nullptr, &of_hangup);
  if (of_hangup.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);  // not under nohup
}

bool interrupted() { return interrupt_flag != 0; }

void throw_if_interrupted() {
  if (interrupted()) throw Interrupted();
}

void add_precision(CLI::App& app, std::string& precision) {
  app.add_option("--precision", precision,
                 "full (default), or fast: sampler models only, almost all values within 1/255")
      ->check(CLI::IsMember({"full", "fast"}))
      ->type_name("full|fast");
}

int run_tool(CLI::App& app, int argc, char** argv, const std::function<void()>& work) {
  app.failure_message([](const CLI::App* failed, const CLI::Error& error) {
    const std::string& name = failed->get_name();
    return name + ": " + error.what() + "\nSee " + name + " --help for all options.\n";
  });
  add_completion(app);
  add_talk(app);
  app.set_version_flag("--version", app.get_name() + " " + solidtex::version());
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? exit_success : exit_usage;
  }
  signal(SIGXFSZ, SIG_IGN);  // a file that reaches `ulimit -f` is a failed write, with its message
  try {
    if (is_verbose()) say(app.get_name() + " " + solidtex::version() + ", " + solidtex::target());
    work();
    print_json(app);
    std::cout.flush();
    if (!std::cout || std::fflush(stdout) != 0 || std::ferror(stdout))
      throw std::runtime_error("standard output: cannot write");
    return exit_success;
  } catch (const Interrupted& error) {
    return fail(app, error.what(), exit_interrupted);
  } catch (const std::bad_alloc&) {
    return fail(app, out_of_memory);
  } catch (const solidtex::error& error) {
    return fail(app, error.status() == SOLIDTEX_OUT_OF_MEMORY ? out_of_memory : error.what());
  } catch (const std::exception& error) {
    return fail(app, error.what());
  }
}

}  // namespace solidtex::tools
