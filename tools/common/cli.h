// Shared parts of the command-line tools: options, error messages, exit codes, Ctrl-C.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <solidtex/solidtex.hpp>
#include <stdexcept>
#include <string>
#include <vector>

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

// Adds an option for an integer from 0 to 2^64 - 1.
CLI::Option* add_seed(CLI::App& app, const std::string& name,
                      const std::function<void(std::uint64_t)>& set,
                      const std::string& description);

// Checks of an option's value, whose messages say in words what is allowed. A map also replaces the
// name by its value.
CLI::Validator in_range(int low, int high);
CLI::Validator in_range(double low, double high);
CLI::Validator one_of(const std::vector<std::string>& names);
template <class Value>
CLI::Validator one_of(const std::map<std::string, Value>& values) {
  std::vector<std::string> names;
  names.reserve(values.size());
  for (const auto& entry : values) names.push_back(entry.first);
  const auto replace = [check = one_of(names), values](std::string& name) {
    std::string message = check(name);
    if (message.empty()) name = std::to_string(static_cast<int>(values.at(name)));
    return message;
  };
  return CLI::Validator(replace, "");
}

// Results go to standard output, everything else to standard error. run_tool adds the options
// --quiet, --verbose, --json and --config to every tool that has none of that name.
bool is_quiet();
bool is_verbose();
bool is_json();

// Prints a remark to standard error unless --quiet.
void say(const std::string& text);

// "1 sample", "16 samples", "2.5 million samples"
std::string count_of(std::uint64_t count, const std::string& noun);

// Standard output for results in words; standard error where --json or `-o -` needs it.
std::FILE* results();

// Adds a result to the object that --json prints.
void report(const std::string& name, const nlohmann::ordered_json& value);

// Reports a written file: its path on a line, `about` behind it, or with --json in the object that
// ends the run. The file of `-o -` is copied to standard output.
void report_file(const std::filesystem::path& path, const std::string& about = "");

// Turns `-o -` into a file in a temporary folder, for report_file(). `name` is that of the file;
// `-o -.exr` has another extension. Returns whether the output goes to standard output.
bool pipe_output(std::filesystem::path& output, const std::string& name);

// Adds --version, parses, runs `work`. Prints errors to stderr and returns the exit code.
int run_tool(CLI::App& app, int argc, char** argv, const std::function<void()>& work);

}  // namespace solidtex::tools
