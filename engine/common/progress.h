// Progress of a query: reports to the host's callback and cancellation by it.
#pragma once

#include <solidtex/solidtex.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <thread>

namespace solidtex::engine {

// Who hears of a query: the host of its texture, and the owner of its token.
struct ProgressListener {
  solidtex_progress_callback callback = nullptr;
  void* user = nullptr;
  solidtex_progress_callback token_callback = nullptr;
  void* token_user = nullptr;
  std::uint64_t query = 0;  // counts queries with a token: each reports when it begins

  bool operator==(const ProgressListener&) const = default;
  bool has_callback() const { return callback || token_callback; }
  // Reports progress; returns true if the query is to be cancelled.
  bool report(double done) const {
    return (callback && callback(user, done)) ||
           (token_callback && token_callback(token_user, done));
  }
};

// While this object lives, the progress of this thread's work is mapped to a range of its query.
class ProgressScope {
 public:
  explicit ProgressScope(const ProgressListener& listener) { enter({listener, 0, 1}); }
  // Maps to the part from `from` to `to` of the enclosing range.
  ProgressScope(double from, double to);
  // Maps to one of `parts` equal parts.
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
  // Continues a range on another thread.
  explicit ProgressScope(const Range& range) { enter(range); }

 private:
  void enter(const Range& range);
  Range before_;
};

// Progress of one loop. The querying thread creates it; the workers share it.
class LoopProgress {
 public:
  explicit LoopProgress(std::size_t count)
      : range_(ProgressScope::of_this_thread()),
        caller_(std::this_thread::get_id()),
        count_(count) {}

  bool has_callback() const { return range_.listener.has_callback(); }
  void add(std::size_t done) { done_.fetch_add(done, std::memory_order_relaxed); }

  // Reports progress if this is the querying thread. Throws Error on any thread once the callback
  // has cancelled the query.
  void check();

 private:
  ProgressScope::Range range_;
  std::thread::id caller_;
  std::size_t count_;
  std::atomic<std::size_t> done_ = 0;
  std::atomic<bool> cancelled_ = false;
};

}  // namespace solidtex::engine
