#include "engine/texture/interrupt.h"

#include "engine/model/error.h"

namespace solidtex::engine {
namespace {

// Short for a person who waits, long beside what asking costs.
constexpr std::chrono::milliseconds kPause{50};

}  // namespace

InterruptQuestion& question_of_this_thread() {
  thread_local InterruptQuestion question;
  return question;
}

void Interrupt::check() {
  if (std::this_thread::get_id() == asker_ && !stopped_ && is_possible()) {
    const auto now = std::chrono::steady_clock::now();
    if (now - question_.asked >= kPause) {
      stopped_ = question_.ask(question_.user) != 0;
      question_.asked = std::chrono::steady_clock::now();
    }
  }
  if (stopped_) throw Error(SOLIDTEX_CANCELLED, "the host has stopped the query");
}

}  // namespace solidtex::engine
