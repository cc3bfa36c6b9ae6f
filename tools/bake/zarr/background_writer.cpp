#include "tools/bake/zarr/background_writer.h"

#include <utility>

namespace solidtex::tools {

BackgroundWriter::BackgroundWriter(std::size_t max_queued_bytes)
    : max_queued_bytes_(max_queued_bytes), thread_([this] { run(); }) {}

BackgroundWriter::~BackgroundWriter() {
  {
    const std::lock_guard lock(mutex_);
    stops_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void BackgroundWriter::push(std::size_t bytes, std::function<void()> task) {
  std::unique_lock lock(mutex_);
  wait_until(lock, [&] { return queued_bytes_ <= max_queued_bytes_; });
  queued_bytes_ += bytes;
  tasks_.push_back({bytes, std::move(task)});
  changed_.notify_all();
}

void BackgroundWriter::finish() {
  std::unique_lock lock(mutex_);
  wait_until(lock, [&] { return tasks_.empty(); });
}

void BackgroundWriter::wait_until(std::unique_lock<std::mutex>& lock,
                                  const std::function<bool()>& condition) {
  changed_.wait(lock, [&] { return error_ || condition(); });
  if (error_) std::rethrow_exception(error_);
}

void BackgroundWriter::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return stops_ || !tasks_.empty(); });
    if (stops_) return;
    // A task is destroyed before it counts as done: it may own the last file.
    std::function<void()> task = std::move(tasks_.front().run);
    lock.unlock();
    std::exception_ptr error;
    try {
      task();
    } catch (...) {
      error = std::current_exception();
    }
    task = nullptr;
    lock.lock();
    queued_bytes_ -= tasks_.front().bytes;
    tasks_.pop_front();
    error_ = error;
    changed_.notify_all();
    if (error) return;
  }
}

}  // namespace solidtex::tools
