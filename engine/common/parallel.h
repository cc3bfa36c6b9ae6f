// How a query uses the calling thread's oneTBB arena.
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

// The default floating-point environment for one scope. Hosts switch denormals off (Embree advises
// it) or change the rounding; our bits must not depend on that.
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

// How finely a loop is cut: `least` is worth a thread, and where the host hears of the progress, it
// is told each time that `strip` are done.
struct Grain {
  constexpr Grain(std::size_t least_, std::size_t strip_ = 1) : least(least_), strip(strip_) {}
  std::size_t least, strip;
};

// Runs work(begin, end) over parts of [0, count) of about `grain.least` or more, in parallel.
// Isolated, so that a thread that waits here for the rest of a query never picks up one of the
// host's own tasks, whose locks and scratch memory it may hold. The context of its own keeps a
// cancelled host task from leaving values unwritten, and hands this thread's float mode on.
template <class Work>
void for_each_part(std::size_t count, Grain grain, const Work& work) {
  if (count == 0) return;
  if (count <= grain.least) return work(std::size_t{0}, count);
  LoopProgress progress(count);
  progress.check();  // before a worker may have done a part
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
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, grain.least), work_on,
                      tbb::auto_partitioner(), context);
  });
}

}  // namespace solidtex::engine
