#include "tools/bench/clock.h"

namespace solidtex::tools {
namespace {

// The processor time of one thread is its own: idle workers that look for something to do do not
// count.
clockid_t clock_id(Clock clock, int threads) {
  if (clock == Clock::wall) return CLOCK_MONOTONIC;
  return threads == 1 ? CLOCK_THREAD_CPUTIME_ID : CLOCK_PROCESS_CPUTIME_ID;
}

}  // namespace

Stopwatch::Stopwatch(Clock clock, int threads)
    : id_(clock_id(clock, threads)), threads_(clock == Clock::cpu ? threads : 1), start_(now()) {}

double Stopwatch::now() const {
  timespec time = {};
  clock_gettime(id_, &time);
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) * 1e-9;
}

double Stopwatch::seconds() const { return (now() - start_) / threads_; }

}  // namespace solidtex::tools
