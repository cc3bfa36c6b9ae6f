// Command line of solidtex-mix.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

namespace solidtex::tools {

struct MixOptions {
  std::vector<std::string> inputs;
  std::vector<std::string> weights;  // "0.5,0.5", one for each --weights
  std::string space;                 // empty: the one that the inputs name
  std::filesystem::path output;
  int frames = 0;  // of --animate; 0: one model
  bool force = false;
};

void add_options(CLI::App& app, MixOptions& options);

// A model to write: its file, and a weight for each input.
struct Frame {
  std::filesystem::path output;
  std::vector<double> weights;
};

// Returns the models to write. Throws for weights and names that do not go with the options.
std::vector<Frame> frames_of(const MixOptions& options);

}  // namespace solidtex::tools
