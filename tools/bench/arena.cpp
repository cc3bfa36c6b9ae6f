#include "tools/bench/arena.h"

#include <pthread.h>

namespace solidtex::tools {
namespace {

double read_clock(clockid_t id) {
  timespec time = {};
  clock_gettime(id, &time);
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) * 1e-9;
}

}  // namespace

const char* clock_name(Clock clock) { return clock == Clock::wall ? "wall" : "cpu"; }

Stopwatch::Stopwatch(Clock clock)
    : id_(clock == Clock::wall ? CLOCK_MONOTONIC : CLOCK_THREAD_CPUTIME_ID),
      start_(read_clock(id_)) {}

double Stopwatch::seconds() const { return read_clock(id_) - start_; }

Arena::Arena(int threads) : threads_(threads), arena_(threads), members_(arena_) {}

double Arena::now(Clock clock) {
  return clock == Clock::wall ? read_clock(CLOCK_MONOTONIC) : members_.cpu_seconds() / threads_;
}

Arena::Members::Members(tbb::task_arena& arena) : task_scheduler_observer(arena) { observe(true); }

Arena::Members::~Members() { observe(false); }

void Arena::Members::on_scheduler_entry(bool) {
  clockid_t id;
  if (pthread_getcpuclockid(pthread_self(), &id) != 0) return;
  const std::lock_guard lock(mutex_);
  clocks_.emplace(id, read_clock(id));
}

double Arena::Members::cpu_seconds() {
  const std::lock_guard lock(mutex_);
  double sum = 0;
  for (const auto& [id, first] : clocks_) sum += read_clock(id) - first;
  return sum;
}

}  // namespace solidtex::tools
