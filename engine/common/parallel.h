// Parallel loops in the calling thread's oneTBB arena.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <cfenv>
#include <cstddef>

#include "engine/common/progress.h"

namespace solidtex::engine {

// Default floating-point environment for one scope. Hosts flush denormals (Embree advises it) or
// change the rounding; values must not depend on that.
class DefaultFloatMode {
 public:
  DefaultFloatMode() {
    std::fegetenv(&saved_);
    std::fesetenv(FE_DFL_ENV);
  }
  ~DefaultFloatMode() { std::fesetenv(&saved_); }
  DefaultFloatMode(const DefaultFloatMode&) = delete;
  DefaultFloatMode& operator=(const DefaultFloatMode&) = delete;

 private:
  std::fenv_t saved_;
};

// Grain of a loop: `min_size` items are worth a thread. With a progress callback, a thread reports
// after every `strip` items.
struct Grain {
  constexpr Grain(std::size_t min_size_, std::size_t strip_ = 1)
      : min_size(min_size_), strip(strip_) {}
  std::size_t min_size, strip;
};

// Runs work(begin, end) over parts of [0, count), in parallel. A part has about `grain.min_size`
// items or more.
//
// The loop is isolated: a thread that waits here never runs one of the host's own tasks, whose
// locks and scratch memory it may hold. The loop has a context of its own: a cancelled host task
// leaves no value unwritten, and workers inherit this thread's floating-point mode.
template <class Work>
void for_each_part(std::size_t count, Grain grain, const Work& work) {
  if (count == 0) return;
  if (count <= grain.min_size) return work(std::size_t{0}, count);
  LoopProgress progress(count);
  progress.check();  // before a worker may have finished a part
  const auto work_on = [&](const tbb::blocked_range<std::size_t>& part) {
    if (!progress.has_callback()) return work(part.begin(), part.end());
    for (std::size_t begin = part.begin(); begin < part.end(); begin += grain.strip) {
      const std::size_t end = std::min(begin + grain.strip, part.end());
      progress.check();
      work(begin, end);
      progress.add(end - begin);
    }
  };
  tbb::task_group_context context(
      tbb::task_group_context::isolated,
      tbb::task_group_context::default_traits | tbb::task_group_context::fp_settings);
  tbb::this_task_arena::isolate([&] {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, grain.min_size), work_on,
                      tbb::auto_partitioner(), context);
  });
}

}  // namespace solidtex::engine
