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
  std::filesystem::path json;  // empty: none
  bool list = false, force = false;
};

void add_options(CLI::App& app, BenchOptions& options);

}  // namespace solidtex::tools
