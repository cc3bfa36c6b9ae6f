// Runs the same cases on several instruction sets, each in a process of its own.
#pragma once

#include "tools/bench/options.h"
#include "tools/bench/report.h"

namespace solidtex::tools {

Report compare_targets(const BenchOptions& options);

}  // namespace solidtex::tools
