// What this machine's arithmetic units can do.
#pragma once

#include <string>
#include <vector>

#include "tools/bench/arena.h"

namespace solidtex::tools {

// Single-precision operations a second, measured for a few milliseconds on `threads` threads at
// once: a loop of independent fused multiply-adds in registers. A multiply-add is two operations.
double measure_peak(int threads, Clock clock);

// The instruction sets of this machine with fused multiply-add, by Highway's names, best first.
std::vector<std::string> fused_targets();

}  // namespace solidtex::tools
