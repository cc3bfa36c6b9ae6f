#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

#include "catch.hpp"
#include "engine/cache/brick_cache.h"

using solidtex::engine::BrickCache;
using solidtex::engine::BrickKey;
using solidtex::engine::CacheStats;

namespace {

constexpr std::size_t kValues = 100;
constexpr std::uint64_t kBytes = kValues * sizeof(float);

float value_of(const BrickKey& key) {
  return static_cast<float>(key.x + 100 * key.y + 10000 * key.z);
}

void fill(const BrickKey& key, std::span<float> values) {
  for (float& value : values) value = value_of(key);
}

void run_threads(int count, const std::function<void(int)>& work) {
  std::vector<std::thread> threads;
  for (int i = 0; i < count; ++i) threads.emplace_back(work, i);
  for (std::thread& thread : threads) thread.join();
}

}  // namespace

TEST_CASE("brick cache: a brick is computed once and then found", "[cache][tsan]") {
  int built = 0;
  BrickCache cache(kValues, 100 * kBytes, [&](const BrickKey& key, std::span<float> values) {
    ++built;
    fill(key, values);
  });
  const BrickKey key{-3, 7, 11};
  for (int i = 0; i < 5; ++i) {
    const auto brick = cache.get(key);
    CHECK(brick.get()[0] == value_of(key));
    CHECK(brick.get()[kValues - 1] == value_of(key));
  }
  CHECK(built == 1);
  const CacheStats stats = cache.stats();
  CHECK(stats.hit_count == 4);
  CHECK(stats.miss_count == 1);
  CHECK(stats.brick_count == 1);
  CHECK(stats.resident_bytes == kBytes);
  CHECK(stats.peak_bytes == kBytes);
}

TEST_CASE("brick cache: the bound holds and the least recently used brick is evicted first",
          "[cache][tsan]") {
  BrickCache cache(kValues, 3 * kBytes + 1, fill);  // three bricks, one shard
  for (int x = 0; x < 3; ++x) cache.get({x, 0, 0});
  cache.get({0, 0, 0});  // now 1 is the least recently used
  cache.get({3, 0, 0});
  CHECK(cache.stats().resident_bytes == 3 * kBytes);
  CHECK(cache.stats().miss_count == 4);
  for (const int x : {0, 2, 3}) cache.get({x, 0, 0});
  CHECK(cache.stats().miss_count == 4);
  cache.get({1, 0, 0});
  CHECK(cache.stats().miss_count == 5);
  CHECK(cache.stats().brick_count == 4);
}

TEST_CASE("brick cache: many bricks never exceed the limit", "[cache][tsan]") {
  for (const std::uint64_t limit : {kBytes * 7, kBytes * 100, kBytes * 1000 + 99}) {
    BrickCache cache(kValues, limit, fill);
    for (int i = 0; i < 3000; ++i) {
      const BrickKey key{i % 10, i / 10 % 10, i / 100};
      REQUIRE(cache.get(key).get()[1] == value_of(key));
    }
    CHECK(cache.stats().peak_bytes <= limit);
    CHECK(cache.stats().peak_bytes > limit / 2);
    CHECK(cache.stats().resident_bytes <= cache.stats().peak_bytes);
  }
}

TEST_CASE("brick cache: a limit below one brick keeps nothing but computes every brick",
          "[cache][tsan]") {
  for (const std::uint64_t limit : {std::uint64_t{0}, kBytes - 1}) {
    BrickCache cache(kValues, limit, fill);
    for (int i = 0; i < 3; ++i) CHECK(cache.get({5, 6, 7}).get()[0] == value_of({5, 6, 7}));
    CHECK(cache.stats().miss_count == 3);
    CHECK(cache.stats().brick_count == 1);
    CHECK(cache.stats().peak_bytes == 0);
  }
}

TEST_CASE("brick cache: a brick in use outlives its place in the cache", "[cache][tsan]") {
  BrickCache cache(kValues, kBytes, fill);
  const auto held = cache.get({1, 2, 3});
  for (int x = 0; x < 10; ++x) cache.get({x, 0, 0});
  CHECK(held.get()[50] == value_of({1, 2, 3}));
}

TEST_CASE("brick cache: threads that request a brick together share one computation",
          "[cache][tsan]") {
  std::atomic<int> built = 0;
  BrickCache cache(kValues, 1000 * kBytes, [&](const BrickKey& key, std::span<float> values) {
    ++built;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    fill(key, values);
  });
  std::atomic<int> wrong = 0;
  run_threads(8, [&](int) {
    for (int x = 0; x < 20; ++x) {
      if (cache.get({x, 0, 0}).get()[3] != value_of({x, 0, 0})) ++wrong;
    }
  });
  CHECK(wrong == 0);
  CHECK(built == 20);
  CHECK(cache.stats().miss_count == 20);
  CHECK(cache.stats().hit_count == 7 * 20);
}

TEST_CASE("brick cache: threads under a tiny limit get right values", "[cache][tsan]") {
  BrickCache cache(kValues, 4 * kBytes, fill);
  std::atomic<int> wrong = 0;
  run_threads(8, [&](int thread) {
    for (int i = 0; i < 2000; ++i) {
      const BrickKey key{(i * 7 + thread) % 11, (i * 3) % 5, 0};
      if (cache.get(key).get()[i % kValues] != value_of(key)) ++wrong;
    }
  });
  CHECK(wrong == 0);
  CHECK(cache.stats().peak_bytes <= 4 * kBytes);
  CHECK(cache.stats().hit_count + cache.stats().miss_count == 8 * 2000);
}

TEST_CASE("brick cache: a failure reaches all waiting threads, and the next request tries again",
          "[cache][tsan]") {
  std::atomic<bool> broken = true;
  BrickCache cache(kValues, 10 * kBytes, [&](const BrickKey& key, std::span<float> values) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    if (broken) throw std::runtime_error("no luck");
    fill(key, values);
  });
  std::atomic<int> failed = 0;
  run_threads(4, [&](int) {
    try {
      cache.get({1, 1, 1});
    } catch (const std::runtime_error&) {
      ++failed;
    }
  });
  CHECK(failed == 4);
  CHECK(cache.stats().resident_bytes == 0);
  broken = false;
  CHECK(cache.get({1, 1, 1}).get()[0] == value_of({1, 1, 1}));
}
