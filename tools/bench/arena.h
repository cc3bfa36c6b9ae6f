// So many threads to run a case on, and the time that they spend.
#pragma once

#include <tbb/task_arena.h>
#include <tbb/task_scheduler_observer.h>

#include <ctime>
#include <map>
#include <mutex>

#include "tools/bench/clock.h"

namespace solidtex::tools {

class Arena {
 public:
  explicit Arena(int threads);

  int threads() const { return threads_; }

  // Seconds that `work` takes here.
  template <class Work>
  double time(Clock clock, const Work& work) {
    return arena_.execute([&] {
      const double start = now(clock);
      work();
      return now(clock) - start;
    });
  }

 private:
  // Collects the processor clocks of all threads that ever work in the arena. The clock of the
  // whole process will not do: it knows what other threads did only up to their last timer tick,
  // some milliseconds ago.
  class Members : public tbb::task_scheduler_observer {
   public:
    explicit Members(tbb::task_arena& arena);
    ~Members();
    void on_scheduler_entry(bool is_worker) override;
    double cpu_seconds();

   private:
    std::mutex mutex_;
    std::map<clockid_t, double> clocks_;  // with what they said when their thread first came
  };

  double now(Clock clock);

  int threads_;
  tbb::task_arena arena_;
  Members members_;
};

}  // namespace solidtex::tools
