// Parallel loops in the calling thread's arena.
#pragma once

#include <algorithm>
#include <cfenv>
#include <cstddef>

#include "engine/common/arena.h"
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
template <class Work>
void for_each_part(std::size_t count, Grain grain, const Work& work) {
  if (count == 0) return;
  if (count <= grain.min_size) return work(std::size_t{0}, count);
  LoopProgress progress(count);
  progress.check();  // before a worker may have finished a part
  run_parts(count, grain.min_size, [&](std::size_t part_begin, std::size_t part_end) {
    if (!progress.has_callback()) return work(part_begin, part_end);
    for (std::size_t begin = part_begin; begin < part_end; begin += grain.strip) {
      const std::size_t end = std::min(begin + grain.strip, part_end);
      progress.check();
      work(begin, end);
      progress.add(end - begin);
    }
  });
}

}  // namespace solidtex::engine
