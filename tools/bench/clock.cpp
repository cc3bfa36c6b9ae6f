#include "tools/bench/clock.h"

namespace solidtex::tools {

const char* clock_name(Clock clock) { return clock == Clock::wall ? "wall" : "cpu"; }

double read_clock(clockid_t id) {
  timespec time = {};
  clock_gettime(id, &time);
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) * 1e-9;
}

Stopwatch::Stopwatch(Clock clock)
    : id_(clock == Clock::wall ? CLOCK_MONOTONIC : CLOCK_THREAD_CPUTIME_ID),
      start_(read_clock(id_)) {}

}  // namespace solidtex::tools
