#include "tools/common/completion.h"

#include <algorithm>
#include <cctype>
#include <sstream>
#include <string>
#include <vector>

#include "tools/common/cli.h"

namespace solidtex::tools {
namespace {

// One long name of an option.
struct Entry {
  std::string name, description;
  bool has_value;
  std::string values;  // "full fast"; empty: any, a file for example
};

// The three shells give these characters a meaning.
std::string plain(std::string text) {
  std::erase_if(text,
                [](char c) { return std::string("'\"[]:`$\\").find(c) != std::string::npos; });
  return text;
}

// "full|fast" lists all values; "N|X,Y,Z" does not.
std::string values_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  std::string values = type.substr(0, type.find(':'));  // the check's description follows
  const auto is_value = [](char c) {
    return std::islower(static_cast<unsigned char>(c)) || c == '|' || c == '-' ||
           std::isdigit(static_cast<unsigned char>(c));
  };
  if (values.find('|') == std::string::npos || !std::ranges::all_of(values, is_value)) return "";
  std::ranges::replace(values, '|', ' ');
  return values;
}

std::vector<Entry> entries_of(const CLI::App& app) {
  std::vector<Entry> entries;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) {
      entries.push_back({name, plain(option->get_description()),
                         option->get_items_expected_max() > 0, values_of(*option)});
    }
  }
  return entries;
}

std::string bash_script(const std::string& program, const std::vector<Entry>& entries) {
  std::ostringstream script;
  script << "complete -o default -o bashdefault -W '";
  for (const Entry& entry : entries) script << "--" << entry.name << ' ';
  script << "' " << program << '\n';
  return script.str();
}

std::string zsh_script(const std::string& program, const std::vector<Entry>& entries) {
  std::ostringstream script;
  script << "#compdef " << program << "\n_arguments '*:file:_files'";
  for (const Entry& entry : entries) {
    script << " \\\n  '--" << entry.name << '[' << entry.description << ']';
    if (entry.has_value) {
      script << ":value:" << (entry.values.empty() ? "_files" : "(" + entry.values + ")");
    }
    script << '\'';
  }
  script << '\n';
  return script.str();
}

std::string fish_script(const std::string& program, const std::vector<Entry>& entries) {
  std::ostringstream script;
  for (const Entry& entry : entries) {
    script << "complete -c " << program << " -l " << entry.name << " -d '" << entry.description
           << '\'' << (entry.has_value ? " -r" : "");
    if (!entry.values.empty()) script << " -f -a '" << entry.values << '\'';
    script << '\n';
  }
  return script.str();
}

}  // namespace

void add_completion(CLI::App& app) {
  const auto print = [&app](const std::string& shell) {
    const std::vector<Entry> entries = entries_of(app);
    const auto script = shell == "bash" ? bash_script : shell == "zsh" ? zsh_script : fish_script;
    std::string text = script(app.get_name(), entries);
    text.pop_back();  // CLI11 ends the line
    throw CLI::CallForVersion(text, 0);
  };
  app.add_option_function<std::string>("--completion", print,
                                       "Print a completion script for this shell and exit")
      ->check(one_of({"bash", "zsh", "fish"}))
      ->type_name("bash|zsh|fish")
      ->trigger_on_parse();
}

}  // namespace solidtex::tools
