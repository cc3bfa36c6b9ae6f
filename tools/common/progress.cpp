#include "tools/common/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tools/common/cli.h"

namespace solidtex::tools {
namespace {

constexpr auto print_interval = std::chrono::milliseconds(100);
constexpr const char* erase_line = "\r\033[K";

}  // namespace

std::string format_duration(double seconds) {
  const long long whole = std::llround(std::clamp(seconds, 0.0, 1e9));
  char text[32];
  if (whole >= 3600)
    std::snprintf(text, sizeof text, "%lld:%02lld:%02lld", whole / 3600, whole / 60 % 60,
                  whole % 60);
  else
    std::snprintf(text, sizeof text, "%lld:%02lld", whole / 60, whole % 60);
  return text;
}

Progress::Progress(std::string label, std::uint64_t total)
    : label_(std::move(label)),
      total_(std::max<std::uint64_t>(total, 1)),
      terminal_(isatty(STDERR_FILENO) && !is_quiet()) {}

Progress::~Progress() {
  if (line_open_) std::fputs(erase_line, stderr);
}

double Progress::elapsed() const {
  return std::chrono::duration<double>(Clock::now() - start_).count();
}

void Progress::advance(std::uint64_t count) {
  const std::uint64_t done = done_.fetch_add(count, std::memory_order_relaxed) + count;
  if (!terminal_) return;
  const std::unique_lock lock(mutex_, std::try_to_lock);  // the other thread prints
  if (!lock || finished_ || Clock::now() - last_print_ < print_interval) return;
  last_print_ = Clock::now();
  print(std::min(done, total_));
}

void Progress::print(std::uint64_t done) {
  const double fraction = static_cast<double>(done) / static_cast<double>(total_);
  const double left = done ? elapsed() * (1 / fraction - 1) : 0;
  std::fprintf(stderr, "%s%s %3d %%  %s left", erase_line, label_.c_str(),
               static_cast<int>(100 * fraction), done ? format_duration(left).c_str() : "?");
  std::fflush(stderr);
  line_open_ = true;
}

void Progress::finish() {
  const std::lock_guard lock(mutex_);
  if (finished_) return;
  finished_ = true;
  if (is_quiet()) return;
  std::fprintf(stderr, "%s%s: done in %s\n", line_open_ ? erase_line : "", label_.c_str(),
               format_duration(elapsed()).c_str());
  line_open_ = false;
}

}  // namespace solidtex::tools
