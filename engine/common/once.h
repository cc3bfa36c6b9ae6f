// A call that is made once, on first use. A call that throws is made again by the next user.
#pragma once

#include <atomic>
#include <mutex>

namespace solidtex::engine {

// std::call_once ends the process where the call throws while memory is short: the exception passes
// a frame of the C library, which then loads a library to unwind it.
class Once {
 public:
  template <class Call>
  void run(const Call& call) {
    if (is_done_.load(std::memory_order_acquire)) return;
    const std::lock_guard lock(mutex_);
    if (is_done_.load(std::memory_order_relaxed)) return;
    call();
    is_done_.store(true, std::memory_order_release);
  }

 private:
  std::mutex mutex_;
  std::atomic<bool> is_done_ = false;
};

}  // namespace solidtex::engine
