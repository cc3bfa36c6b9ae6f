// Where a thread's time goes.
#pragma once

#include <time.h>

namespace solidtex::pathtracer {

// Processor time of the calling thread: on a machine that others use too it says what the work
// costs. Some 200 ns a lap.
class Stopwatch {
 public:
  // Adds the time since the last lap, or since it was made, to `total`.
  void lap(double& total) {
    const double now = seconds();
    total += now - last_;
    last_ = now;
  }

 private:
  static double seconds() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

  double last_ = seconds();
};

}  // namespace solidtex::pathtracer
