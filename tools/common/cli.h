// Shared parts of the command-line tools: options, error messages, exit codes, Ctrl-C.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <solidtex/solidtex.hpp>
#include <stdexcept>
#include <string>

namespace solidtex::tools {

inline constexpr int exit_success = 0;
inline constexpr int exit_failure = 1;
inline constexpr int exit_usage = 2;
inline constexpr int exit_interrupted = 130;

// Thrown after Ctrl-C; run_tool returns exit_interrupted for it.
class Interrupted : public std::runtime_error {
 public:
  explicit Interrupted(const std::string& outcome = "nothing was written")
      : std::runtime_error("interrupted, " + outcome) {}
};

// Makes SIGINT, SIGTERM and SIGHUP set a flag. A second signal ends the program at once.
void install_interrupt_handler();
bool interrupted();
void throw_if_interrupted();

// Adds --precision full|fast.
void add_precision(CLI::App& app, std::string& precision);

// Results go to standard output, everything else to standard error. run_tool adds the options
// --quiet, --verbose, --json and --config to every tool that has none of that name.
bool is_quiet();
bool is_verbose();
bool is_json();

// Prints a remark to standard error unless --quiet.
void say(const std::string& text);

// Reports a written file: its path on a line, or with --json in the object that ends the run.
void report_file(const std::filesystem::path& path);

// Adds --version, parses, runs `work`. Prints errors to stderr and returns the exit code.
int run_tool(CLI::App& app, int argc, char** argv, const std::function<void()>& work);

}  // namespace solidtex::tools
