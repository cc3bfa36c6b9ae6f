#include "tools/bench/arena.h"

#include <pthread.h>

namespace solidtex::tools {

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
