// How a host hears of a query between parts of the work, and stops it.
#pragma once

#include <solidtex/solidtex.h>

#include <atomic>
#include <cstddef>
#include <thread>

namespace solidtex::engine {

struct ProgressListener {
  solidtex_progress_callback callback = nullptr;
  void* user = nullptr;
};

// A query of this thread, or a part of it, while this lives: from where to where it takes what is
// done.
class ProgressScope {
 public:
  explicit ProgressScope(const ProgressListener& listener) { enter({listener, 0, 1}); }
  // A part of the one around it, from and to in [0, 1].
  ProgressScope(double from, double to);
  // One of some parts of equal size.
  ProgressScope(std::size_t part, std::size_t parts)
      : ProgressScope(static_cast<double>(part) / static_cast<double>(parts),
                      static_cast<double>(part + 1) / static_cast<double>(parts)) {}
  ~ProgressScope();
  ProgressScope(const ProgressScope&) = delete;
  ProgressScope& operator=(const ProgressScope&) = delete;

  struct Range {
    ProgressListener listener;
    double from = 0, to = 1;

    double at(double part) const { return from + part * (to - from); }
  };
  static const Range& of_this_thread();
  // The same on another thread.
  explicit ProgressScope(const Range& range) { enter(range); }

 private:
  void enter(const Range& range);
  Range before_;
};

// For one loop over parts, made by the thread that queries and shared with the workers.
class LoopProgress {
 public:
  explicit LoopProgress(std::size_t count)
      : range_(ProgressScope::of_this_thread()),
        caller_(std::this_thread::get_id()),
        count_(count) {}

  bool has_callback() const { return range_.listener.callback != nullptr; }
  void add(std::size_t done) { done_.fetch_add(done, std::memory_order_relaxed); }

  // Throws Error when the host has said stop, to any thread; tells it on the querying one.
  void check();

 private:
  ProgressScope::Range range_;
  std::thread::id caller_;
  std::size_t count_;
  std::atomic<std::size_t> done_ = 0;
  std::atomic<bool> stopped_ = false;
};

}  // namespace solidtex::engine
