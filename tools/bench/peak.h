// Peak arithmetic rate of this machine.
#pragma once

#include <string>
#include <vector>

#include "tools/bench/arena.h"

namespace solidtex::tools {

// Measures single-precision operations per second for a few milliseconds on `threads` threads: a
// loop of independent fused multiply-adds in registers. A multiply-add is two operations.
double measure_peak(int threads, Clock clock);

// Returns Highway's names of the machine's instruction sets with fused multiply-add, best first.
std::vector<std::string> fused_targets();

}  // namespace solidtex::tools
