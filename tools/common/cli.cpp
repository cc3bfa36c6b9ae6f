#include "tools/common/cli.h"

#include <stdlib.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <new>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <vector>

#include "plugins/common/near_name.h"
#include "tools/common/completion.h"
#include "tools/common/output_file.h"

namespace solidtex::tools {
namespace {

namespace fs = std::filesystem;

volatile std::sig_atomic_t interrupt_flag = 0;

// What the options of all tools say, and the results of the run.
struct Talk {
  ~Talk() {
    std::error_code ignored;
    if (!piped.empty()) fs::remove_all(piped.parent_path(), ignored);
  }

  bool quiet = false, verbose = false, json = false;
  fs::path piped;  // file in a temporary folder of its own that goes to standard output
  std::vector<std::string> files;
  nlohmann::ordered_json results = nlohmann::ordered_json::object();
} talk;

// Help in which the options that one needs or excludes follow its description.
class HelpText : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override {
    const std::string text = CLI::Formatter::make_option_opts(option);
    return text.substr(0, std::min(text.find(" Needs:"), text.find(" Excludes:")));
  }

  std::string make_option_desc(const CLI::Option* option) const override {
    return option->get_description() + names("; needs ", option->get_needs()) +
           names("; not with ", option->get_excludes());
  }

 private:
  static std::string names(const std::string& before, const std::set<CLI::Option*>& options) {
    std::set<std::string> sorted;
    for (const CLI::Option* option : options) sorted.insert(option->get_name());
    return sorted.empty() ? "" : before + CLI::detail::join(sorted, ", ");
  }
};

// The file of --config.
class OptionFile : public CLI::ConfigTOML {
 public:
  explicit OptionFile(const CLI::App& app) : app_(app) {}

  std::vector<CLI::ConfigItem> from_config(std::istream& stream) const override {
    std::vector<CLI::ConfigItem> items = CLI::ConfigTOML::from_config(stream);
    for (CLI::ConfigItem& item : items) {
      if (const CLI::Option* option = item.parents.empty() ? named(item.name) : nullptr) {
        // An array for an option such as X,Y,Z, which is one value.
        if (option->get_items_expected_max() == 1)
          item.inputs = {CLI::detail::join(item.inputs, ",")};
        continue;
      }
      throw CLI::ConfigError("--config: " + app_.get_config_ptr()->as<std::string>() +
                             ": found an unknown option " +
                             (item.parents.empty() ? item.name : "[" + item.parents.front() + "]") +
                             ", expected one that --help lists");
    }
    return items;
  }

 private:
  const CLI::Option* named(const std::string& name) const {
    for (const char* dashes : {"--", "-", ""})
      if (const CLI::Option* option = app_.get_option_no_throw(dashes + name)) return option;
    return nullptr;
  }

  const CLI::App& app_;
};

void add_talk(CLI::App& app) {
  const auto is_new = [&](const char* name) { return !app.get_option_no_throw(name); };
  if (is_new("--quiet")) app.add_flag("-q,--quiet", talk.quiet, "Print results and errors only");
  if (is_new("--verbose")) app.add_flag("-v,--verbose", talk.verbose, "Print more");
  if (is_new("--json")) {
    app.add_flag("--json", talk.json, "Print the results as JSON to standard output");
  }
  app.set_config("--config", "", "Read options from a TOML file; the command line goes first")
      ->type_name("FILE");
  app.config_formatter(std::make_shared<OptionFile>(app));
}

void print_json(const CLI::App& app) {
  if (!talk.json) return;
  nlohmann::ordered_json document = {{"program", app.get_name()}, {"version", solidtex::version()}};
  document.update(talk.results);
  document["files"] = talk.files;
  std::cout << document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
}

void on_signal(int) { interrupt_flag = 1; }

constexpr char out_of_memory[] =
    "out of memory: the system gave no more; close other programs, raise `ulimit -v`, or make less "
    "at a time";

template <class Number>
CLI::Validator between(Number low, Number high, const char* kind) {
  std::ostringstream range, expected;
  range << low << ".." << high;
  expected << kind << " from " << low << " to " << high;
  const auto check = [low, high, expected = expected.str()](const std::string& text) {
    Number number{};
    if (CLI::detail::lexical_cast(text, number) && low <= number && number <= high)
      return std::string();
    return "found " + text + ", expected " + expected;
  };
  return CLI::Validator(range.str()).operation(check);
}

// What an option got, and what it takes: CLI11 says how many values, in its own words.
std::string mismatch(const CLI::App& app, const std::string& message) {
  const CLI::Option* option = app.get_option_no_throw(message.substr(0, message.find(':')));
  if (!option) return message;
  const std::string separator(1, option->get_delimiter() ? option->get_delimiter() : ' ');
  const std::string found = CLI::detail::join(option->results(), separator);
  const std::string& text = option->get_option_text();
  const std::string type = option->get_type_name();  // the check's description follows
  return option->get_name() + ": found " + (found.empty() ? "nothing" : found) + ", expected " +
         (text.empty() ? type.substr(0, type.find(':')) : text);
}

// What to say of an option that does not exist: those with almost its name.
std::string suggestion(const CLI::App& app, const std::string& argument) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  const std::vector<std::string> near = near_names(argument.substr(0, argument.find('=')), names);
  return near.empty() ? "" : "; did you mean " + CLI::detail::join(near, " or ") + "?";
}

// Help wins over whatever is wrong, and an argument that no program takes over what is missing.
int exit_after(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0) return app.exit(error);
  if (app.get_help_ptr()->count() > 0) return app.exit(CLI::CallForHelp());
  if (app.get_version_ptr()->count() > 0) return app.exit(CLI::CallForVersion(app.version(), 0));
  for (const std::string& argument : app.remaining()) {
    if (argument == "--") continue;
    const std::string found = argument.starts_with('-')
                                  ? "an unknown option " + argument + suggestion(app, argument)
                                  : "an argument too many, " + argument;
    return app.exit(CLI::ExtrasError("found " + found, CLI::ExitCodes::ExtrasError));
  }
  return app.exit(error);
}

int fail(const CLI::App& app, const char* message, int exit_code = exit_failure) {
  std::cerr << app.get_name() << ": " << message << '\n';
  return exit_code;
}

// Names the file in a temporary folder that -o - stands for as it was given.
std::string as_given(std::string message) {
  const std::string piped = talk.piped.string();
  for (std::size_t at = 0; !piped.empty() && (at = message.find(piped, at)) != message.npos;)
    message.replace(at, piped.size(), "-" + talk.piped.extension().string());
  return message;
}

}  // namespace

bool is_quiet() { return talk.quiet; }
bool is_verbose() { return talk.verbose; }
bool is_json() { return talk.json; }

void say(const std::string& text) {
  if (!is_quiet()) std::cerr << text << '\n';
}

std::string count_of(std::uint64_t count, const std::string& noun) {
  char text[32];
  if (count < 100'000)
    std::snprintf(text, sizeof text, "%llu", static_cast<unsigned long long>(count));
  else
    std::snprintf(text, sizeof text, "%.1f million", static_cast<double>(count) * 1e-6);
  return text + (" " + noun) + (count == 1 ? "" : "s");
}

std::FILE* results() { return talk.json || !talk.piped.empty() ? stderr : stdout; }

void report(const std::string& name, const nlohmann::ordered_json& value) {
  talk.results[name] = value;
}

void report_file(const fs::path& path, const std::string& about) {
  talk.files.push_back(path.string());
  if (path == talk.piped) {
    std::cout << std::ifstream(path, std::ios::binary).rdbuf();
    if (!about.empty()) say("-" + about);
  } else if (!is_json()) {
    std::fprintf(results(), "%s%s\n", path.c_str(), about.c_str());
    std::fflush(results());
  }
}

bool pipe_output(fs::path& output, const std::string& name) {
  const std::string given = output.string();
  if (given != "-" && (!given.starts_with("-.") || output.has_parent_path())) return false;
  if (is_json())
    throw CLI::ValidationError("-o", "found " + given +
                                         " with --json, expected one of them: both are for "
                                         "standard output");
  fs::path file = name;
  if (given != "-") file.replace_extension(given.substr(1));
  if (!file.has_extension())
    throw CLI::ValidationError("-o", "found - without a format, expected one, such as -.npy");
  std::string folder = (fs::temp_directory_path() / "solidtex-XXXXXX").string();
  if (!mkdtemp(folder.data())) throw WriteError(folder, std::strerror(errno));
  output = talk.piped = folder / file;
  signal(SIGPIPE, SIG_IGN);  // a reader that ends early is a failed write: the folder is removed
  return true;
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
      ->check(one_of({"full", "fast"}))
      ->type_name("full|fast");
}

// CLI11 would take -1 for the largest number, and 010 for 8.
CLI::Option* add_seed(CLI::App& app, const std::string& name,
                      const std::function<void(std::uint64_t)>& set,
                      const std::string& description) {
  const auto parse = [name, set](const std::string& text) {
    std::uint64_t seed = 0;
    const char* const end = text.data() + text.size();
    const auto [next, error] = std::from_chars(text.data(), end, seed);
    if (error != std::errc() || next != end) {
      throw CLI::ValidationError(
          name, "found " + text + ", expected an integer from 0 to " + std::to_string(UINT64_MAX));
    }
    set(seed);
  };
  return app.add_option_function<std::string>(name, parse, description)->type_name("N");
}

CLI::Validator in_range(int low, int high) { return between(low, high, "a whole number"); }
CLI::Validator in_range(double low, double high) { return between(low, high, "a number"); }

CLI::Validator one_of(const std::vector<std::string>& names) {
  std::string expected = names.front();
  for (std::size_t i = 1; i < names.size(); ++i)
    expected += (i + 1 < names.size() ? ", " : " or ") + names[i];
  const auto check = [names, expected](const std::string& name) {
    const bool is_known = std::find(names.begin(), names.end(), name) != names.end();
    return is_known ? std::string() : "found " + name + ", expected " + expected;
  };
  return CLI::Validator("").operation(check);
}

int run_tool(CLI::App& app, int argc, char** argv, const std::function<void()>& work) {
  app.failure_message([](const CLI::App* failed, const CLI::Error& error) {
    const std::string& name = failed->get_name();
    std::string message = error.what();
    if (error.get_name() == "ArgumentMismatch") message = mismatch(*failed, message);
    if (error.get_name() == "FileError")
      message = "--config: " + failed->get_config_ptr()->as<std::string>() +
                ": found no file that can be read, expected one of options in TOML";
    return name + ": " + message + "\nSee " + name + " --help for all options.\n";
  });
  add_completion(app);
  add_talk(app);
  app.formatter(std::make_shared<HelpText>());
  app.set_version_flag("--version", app.get_name() + " " + solidtex::version());
  signal(SIGXFSZ, SIG_IGN);  // a file that reaches `ulimit -f` is a failed write, with its message
  try {
    app.parse(argc, argv);
    if (is_verbose()) say(app.get_name() + " " + solidtex::version() + ", " + solidtex::target());
    work();
    print_json(app);
    std::cout.flush();
    if (!std::cout || std::fflush(stdout) != 0 || std::ferror(stdout))
      throw WriteError("standard output", std::strerror(errno));
    return exit_success;
  } catch (const CLI::ParseError& error) {
    return exit_after(app, error) == 0 ? exit_success : exit_usage;
  } catch (const Interrupted& error) {
    return fail(app, error.what(), exit_interrupted);
  } catch (const std::bad_alloc&) {
    return fail(app, out_of_memory);
  } catch (const solidtex::error& error) {
    if (error.status() == SOLIDTEX_OUT_OF_MEMORY) return fail(app, out_of_memory);
    return fail(app, as_given(error.what()).c_str());
  } catch (const std::filesystem::filesystem_error& error) {
    const std::string message = error.path1().string() + ": " + error.code().message();
    return fail(app, as_given(message).c_str());
  } catch (const std::exception& error) {
    return fail(app, as_given(error.what()).c_str());
  }
}

}  // namespace solidtex::tools
