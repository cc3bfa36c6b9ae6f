// Counts the scratch memory of a texture's queries.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace solidtex::engine {

class ScratchMeter {
 public:
  std::uint64_t bytes() const { return bytes_.load(std::memory_order_relaxed); }
  std::uint64_t peak() const { return peak_.load(std::memory_order_relaxed); }

  void add(std::uint64_t bytes) {
    const std::uint64_t now = bytes_.fetch_add(bytes, std::memory_order_relaxed) + bytes;
    std::uint64_t peak = peak_.load(std::memory_order_relaxed);
    while (peak < now && !peak_.compare_exchange_weak(peak, now, std::memory_order_relaxed)) {
    }
  }
  void remove(std::uint64_t bytes) { bytes_.fetch_sub(bytes, std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> bytes_ = 0, peak_ = 0;
};

// Counts memory while this object lives. Less than a page is not counted, so that queries of few
// points do not contend for the counter.
class ScratchUse {
 public:
  ScratchUse(ScratchMeter& meter, std::size_t bytes)
      : meter_(meter), bytes_(bytes < kPage ? 0 : bytes) {
    if (bytes_ > 0) meter_.add(bytes_);
  }
  ~ScratchUse() {
    if (bytes_ > 0) meter_.remove(bytes_);
  }
  ScratchUse(const ScratchUse&) = delete;
  ScratchUse& operator=(const ScratchUse&) = delete;

 private:
  static constexpr std::size_t kPage = 4096;
  ScratchMeter& meter_;
  std::size_t bytes_;
};

}  // namespace solidtex::engine
