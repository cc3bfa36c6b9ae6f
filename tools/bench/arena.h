// Clocks, and arenas with a fixed number of threads.
#pragma once

#include <tbb/task_arena.h>
#include <tbb/task_scheduler_observer.h>

#include <ctime>
#include <map>
#include <mutex>

namespace solidtex::tools {

// wall: elapsed time, which other programs lengthen.
// cpu: processor time divided by the number of threads: the elapsed time of an idle machine with
// busy threads. Use it on a shared machine.
enum class Clock { wall, cpu };

const char* clock_name(Clock clock);

// Seconds since its construction, on the thread that constructs and reads it.
class Stopwatch {
 public:
  explicit Stopwatch(Clock clock);
  double seconds() const;

 private:
  clockid_t id_;
  double start_;
};

class Arena {
 public:
  explicit Arena(int threads);

  int threads() const { return threads_; }

  // Returns the seconds that `work` takes in the arena.
  template <class Work>
  double time(Clock clock, const Work& work) {
    return arena_.execute([&] {
      const double start = now(clock);
      work();
      return now(clock) - start;
    });
  }

 private:
  // Processor clocks of all threads that worked in the arena. The clock of the process is too
  // coarse: it counts other threads up to their last timer tick, milliseconds ago.
  class Members : public tbb::task_scheduler_observer {
   public:
    explicit Members(tbb::task_arena& arena);
    ~Members();
    void on_scheduler_entry(bool is_worker) override;
    double cpu_seconds();

   private:
    std::mutex mutex_;
    std::map<clockid_t, double> clocks_;  // with their time when the thread first entered
  };

  double now(Clock clock);

  int threads_;
  tbb::task_arena arena_;
  Members members_;
};

}  // namespace solidtex::tools
