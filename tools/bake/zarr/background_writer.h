// Writes to the disk beside the computation of what is written next.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

namespace solidtex::tools {

// Runs tasks on a thread of its own, in order. The first task that throws is the last.
class BackgroundWriter {
 public:
  explicit BackgroundWriter(std::size_t max_queued_bytes);
  ~BackgroundWriter();  // drops the tasks that have not begun
  BackgroundWriter(const BackgroundWriter&) = delete;
  BackgroundWriter& operator=(const BackgroundWriter&) = delete;

  // Waits while more bytes are queued than the limit. Throws what a task has thrown.
  void push(std::size_t bytes, std::function<void()> task);

  // Waits for all tasks. Throws what a task has thrown.
  void finish();

 private:
  struct Task {
    std::size_t bytes;
    std::function<void()> run;
  };
  void run();
  void wait_until(std::unique_lock<std::mutex>& lock, const std::function<bool()>& condition);

  const std::size_t max_queued_bytes_;
  std::mutex mutex_;  // guards the members below
  std::condition_variable changed_;
  std::deque<Task> tasks_;  // the first one may be running
  std::size_t queued_bytes_ = 0;
  std::exception_ptr error_;
  bool stops_ = false;
  std::thread thread_;
};

}  // namespace solidtex::tools
