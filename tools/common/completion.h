// Completion scripts for shells, generated from the options of a program.
#pragma once

#include <CLI/CLI.hpp>

namespace solidtex::tools {

// Adds --completion bash|zsh|fish, which prints a script and ends the program.
void add_completion(CLI::App& app);

}  // namespace solidtex::tools
