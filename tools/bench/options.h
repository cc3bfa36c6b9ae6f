// The command line of solidtex-bench.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/bench/measure.h"
#include "tools/common/cli.h"

namespace solidtex::tools {

struct BenchOptions {
  std::vector<std::string> patterns;
  CaseSettings cases;
  MeasureSettings measure;
  std::vector<std::string> targets;  // one: run on it; several: compare them
  std::filesystem::path json;        // empty: none
  bool list = false, machine = false, force = false, compare_targets = false;
};

void add_options(CLI::App& app, BenchOptions& options);

}  // namespace solidtex::tools
