// Threads of a query: oneTBB's. Builds without oneTBB have the calling thread alone.
#pragma once

#ifdef SOLIDTEX_WITH_TBB
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>
#endif

#ifdef __SANITIZE_THREAD__
#include <sanitizer/tsan_interface.h>
#endif

#include <cstddef>

namespace solidtex::engine {

#ifdef SOLIDTEX_WITH_TBB

using Arena = tbb::task_arena;

// One object per thread: local() returns that of the calling thread.
template <class T>
using PerThread = tbb::enumerable_thread_specific<T>;

// Returns the number of threads of the calling thread's arena.
inline int max_threads() { return tbb::this_task_arena::max_concurrency(); }

// Runs a call. A thread that waits inside it never runs another task of the arena.
template <class Call>
void isolated(const Call& call) {
  tbb::this_task_arena::isolate(call);
}

// What a loop's caller wrote is visible to its parts, and what they wrote to the caller, also where
// a part throws. oneTBB sees to that, but is not instrumented, so ThreadSanitizer is told. Parts
// stay unordered among themselves: their races are found.
class HandOver {
 public:
#ifdef __SANITIZE_THREAD__
  void give() { __tsan_release(this); }
  void take() { __tsan_acquire(this); }
#else
  void give() {}
  void take() {}
#endif
};
inline HandOver to_parts, from_parts;

// Stands in the caller around a loop.
struct LoopScope {
  LoopScope() { to_parts.give(); }
  ~LoopScope() { from_parts.take(); }
};

// Stands in each part of a loop.
struct PartScope {
  PartScope() { to_parts.take(); }
  ~PartScope() { from_parts.give(); }
};

// Runs a call in an arena: on this thread, or on one of the arena's where all its places are taken.
template <class Call>
void run_in(Arena& arena, const Call& call) {
  const LoopScope loop;
  arena.execute([&] {
    const PartScope part;
    call();
  });
}

// Runs work(begin, end) over parts of [0, count) of about `min_size` items or more, in parallel.
//
// The loop is isolated: a thread that waits here never runs one of the host's own tasks, whose
// locks and scratch memory it may hold. The loop has a context of its own: a cancelled host task
// leaves no value unwritten, and workers inherit this thread's floating-point mode.
template <class Work>
void run_parts(std::size_t count, std::size_t min_size, const Work& work) {
  tbb::task_group_context context(
      tbb::task_group_context::isolated,
      tbb::task_group_context::default_traits | tbb::task_group_context::fp_settings);
  const LoopScope loop;
  isolated([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, count, min_size),
        [&](const tbb::blocked_range<std::size_t>& part) {
          const PartScope scope;
          work(part.begin(), part.end());
        },
        tbb::auto_partitioner(), context);
  });
}

#else

class Arena {
 public:
  explicit Arena(int) {}

  template <class Call>
  void execute(const Call& call) const {
    call();
  }
};

template <class T>
class PerThread {
 public:
  T& local() { return value_; }

 private:
  T value_;
};

template <class Call>
void run_in(const Arena& arena, const Call& call) {
  arena.execute(call);
}

inline int max_threads() { return 1; }

template <class Call>
void isolated(const Call& call) {
  call();
}

template <class Work>
void run_parts(std::size_t count, std::size_t, const Work& work) {
  work(std::size_t{0}, count);
}

#endif

}  // namespace solidtex::engine
