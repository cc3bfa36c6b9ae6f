// Progress line on stderr: percent and time left.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>

namespace solidtex::tools {

// Thread-safe. Without a terminal only finish() prints.
class Progress {
 public:
  Progress(std::string label, std::uint64_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void advance(std::uint64_t count);
  void finish();

 private:
  using Clock = std::chrono::steady_clock;
  double elapsed() const;
  void print(std::uint64_t done);

  const std::string label_;
  const std::uint64_t total_;
  const bool terminal_;
  const Clock::time_point start_ = Clock::now();
  std::atomic<std::uint64_t> done_ = 0;
  std::mutex mutex_;  // guards the members below and the terminal line
  Clock::time_point last_print_ = start_;
  bool line_open_ = false, finished_ = false;
};

// "1:02:03", "4:05"
std::string format_duration(double seconds);

}  // namespace solidtex::tools
