// Two ways to read the time that a piece of work took.
#pragma once

#include <ctime>

namespace solidtex::tools {

// wall: what a clock on the wall says, and with it what else the machine was doing.
// cpu: processor time, divided by the threads that had to work. What a quiet machine would need if
// all threads were always busy; the one to compare with where others use the machine.
enum class Clock { wall, cpu };

const char* clock_name(Clock clock);

// In seconds.
double read_clock(clockid_t id);

// Of the thread that makes and asks it.
class Stopwatch {
 public:
  explicit Stopwatch(Clock clock);
  double seconds() const { return read_clock(id_) - start_; }

 private:
  clockid_t id_;
  double start_;
};

}  // namespace solidtex::tools
