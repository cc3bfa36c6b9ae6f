// Two ways to read the time that a piece of work took.
#pragma once

#include <ctime>

namespace solidtex::tools {

// wall: what a clock on the wall says, and with it what else the machine was doing.
// cpu: processor time, divided by the threads that had to work. What a quiet machine would need if
// all threads were always busy; the one to compare with where others use the machine.
enum class Clock { wall, cpu };

class Stopwatch {
 public:
  Stopwatch(Clock clock, int threads);
  double seconds() const;

 private:
  double now() const;

  clockid_t id_;
  int threads_;
  double start_;
};

}  // namespace solidtex::tools
