// Shared parts of the command-line tools: options, error messages, exit codes, Ctrl-C.
#pragma once

#include <CLI/CLI.hpp>
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

// Adds --version, parses, runs `work`. Prints errors to stderr and returns the exit code.
int run_tool(CLI::App& app, int argc, char** argv, const std::function<void()>& work);

}  // namespace solidtex::tools
