#include "engine/common/progress.h"

#include <chrono>

#include "engine/common/error.h"

namespace solidtex::engine {
namespace {

using Clock = std::chrono::steady_clock;

// Time between two reports: short for a waiting user, long compared with the cost of a call.
constexpr std::chrono::milliseconds kPause{50};

// Last report of a thread.
struct LastReport {
  ProgressListener listener;
  Clock::time_point when{};

  bool is_due(const ProgressListener& next) const {
    return listener != next || Clock::now() - when >= kPause;
  }
};

ProgressScope::Range& range_of_this_thread() {
  thread_local ProgressScope::Range range;
  return range;
}

}  // namespace

const ProgressScope::Range& ProgressScope::of_this_thread() { return range_of_this_thread(); }

void ProgressScope::enter(const Range& range) {
  before_ = range_of_this_thread();
  range_of_this_thread() = range;
}

ProgressScope::ProgressScope(double from, double to) {
  const Range& around = range_of_this_thread();
  enter({around.listener, around.at(from), around.at(to)});
}

ProgressScope::~ProgressScope() { range_of_this_thread() = before_; }

void LoopProgress::check() {
  thread_local LastReport last;
  if (has_callback() && std::this_thread::get_id() == caller_ && !cancelled_ &&
      last.is_due(range_.listener)) {
    const double done = static_cast<double>(done_.load(std::memory_order_relaxed));
    last.listener = range_.listener;
    cancelled_ = range_.listener.report(range_.at(done / static_cast<double>(count_)));
    last.when = Clock::now();
  }
  if (cancelled_) throw Error(SOLIDTEX_CANCELLED, "the progress callback stopped the query");
}

}  // namespace solidtex::engine
