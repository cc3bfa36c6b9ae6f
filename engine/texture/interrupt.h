// How a host stops a query: it is asked between parts of the work.
#pragma once

#include <solidtex/solidtex.h>

#include <atomic>
#include <chrono>
#include <thread>

namespace solidtex::engine {

// What the queries of one thread ask, see solidtex_set_interrupt.
struct InterruptQuestion {
  solidtex_interrupt ask = nullptr;
  void* user = nullptr;
  std::chrono::steady_clock::time_point asked{};
};

InterruptQuestion& question_of_this_thread();

// For one loop over parts, made by the thread that queries and shared with the workers.
class Interrupt {
 public:
  Interrupt() : question_(question_of_this_thread()), asker_(std::this_thread::get_id()) {}

  bool is_possible() const { return question_.ask != nullptr; }

  // Throws Error when the host has said stop, to any thread; asks it on the querying one.
  void check();

 private:
  InterruptQuestion& question_;
  std::thread::id asker_;
  std::atomic<bool> stopped_ = false;
};

}  // namespace solidtex::engine
