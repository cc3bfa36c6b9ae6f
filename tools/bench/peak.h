// The most single-precision arithmetic that this machine does, measured.
#pragma once

#include "tools/bench/clock.h"

namespace solidtex::tools {

// Floating-point operations a second of a loop of nothing but fused multiply-adds in registers, on
// so many threads at once, for a few milliseconds. A multiply-add counts as two.
double measure_peak(int threads, Clock clock);

}  // namespace solidtex::tools
