#include "engine/cache/brick_cache.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <list>
#include <mutex>
#include <new>
#include <unordered_map>
#include <unordered_set>

#include "engine/common/arena.h"

namespace solidtex::engine {
namespace {

constexpr std::size_t kMaxShards = 64;
constexpr std::size_t kMinBricksPerShard = 8;

std::uint64_t hash_of(const BrickKey& key) {
  std::uint64_t h = static_cast<std::uint32_t>(key.x);
  for (const std::int32_t next : {key.y, key.z}) {
    h = (h ^ (h >> 29)) * 0xBF58476D1CE4E5B9 + static_cast<std::uint32_t>(next);
  }
  h = (h ^ (h >> 30)) * 0x94D049BB133111EB;
  return h ^ (h >> 31);
}

struct KeyHash {
  std::size_t operator()(const BrickKey& key) const {
    return static_cast<std::size_t>(hash_of(key));
  }
};

// A small limit has few shards, so that each holds enough bricks for an order of recent use.
std::size_t shard_count(std::uint64_t limit_bricks) {
  return std::clamp<std::uint64_t>(limit_bricks / kMinBricksPerShard, 1, kMaxShards);
}

}  // namespace

// Created by the first thread that requests it. Other threads wait on `state`.
struct BrickCache::Brick {
  enum State : int { building, ready, failed };

  std::atomic<State> state = building;
  std::unique_ptr<float[]> values;
  std::exception_ptr failure;

  void finish(State result) {
    state.store(result, std::memory_order_release);
    state.notify_all();
  }

  void wait() const {
    state.wait(building, std::memory_order_acquire);
    if (state.load(std::memory_order_acquire) == failed) std::rethrow_exception(failure);
  }
};

struct BrickCache::Shard {
  static constexpr std::size_t kMaxDropped = 1 << 13;
  using Order = std::list<BrickKey>;
  struct Entry {
    std::shared_ptr<Brick> brick;
    Order::iterator place;  // in `recent`, or its end while the brick is being computed
  };

  mutable std::mutex mutex;
  std::unordered_map<BrickKey, Entry, KeyHash> entries;
  Order recent;                                   // finished bricks, most recently used first
  std::unordered_set<BrickKey, KeyHash> dropped;  // those that count when they are computed again
  std::uint64_t hit_count = 0, miss_count = 0, repeated_count = 0;

  // Without memory for it, or beyond the limit, the key of a brick is forgotten: the statistics
  // then count it as another one.
  void drop(const BrickKey& key) noexcept {
    entries.erase(key);
    try {
      if (dropped.size() < kMaxDropped) dropped.insert(key);
    } catch (const std::bad_alloc&) {
    }
  }
};

struct BrickCache::Total {
  std::atomic<std::uint64_t> resident_bytes = 0, peak_bytes = 0, nanoseconds = 0;

  void add(std::uint64_t bytes) {
    const std::uint64_t now = resident_bytes.fetch_add(bytes) + bytes;
    std::uint64_t peak = peak_bytes.load();
    while (peak < now && !peak_bytes.compare_exchange_weak(peak, now)) {
    }
  }
};

BrickCache::BrickCache(std::size_t brick_values, std::uint64_t limit_bytes, Build build)
    : brick_values_(brick_values),
      brick_bytes_(brick_values * sizeof(float)),
      build_(std::move(build)),
      shards_(shard_count(limit_bytes / brick_bytes_)),
      bricks_per_shard_(limit_bytes / brick_bytes_ / shards_.size()),
      total_(std::make_unique<Total>()) {}

BrickCache::~BrickCache() = default;

BrickCache::Shard& BrickCache::shard_of(const BrickKey& key) {
  // The map inside a shard uses the low bits of the hash, the choice of a shard the high ones.
  return shards_[(hash_of(key) >> 40) % shards_.size()];
}

std::shared_ptr<const float> BrickCache::get(const BrickKey& key) {
  Shard& shard = shard_of(key);
  std::shared_ptr<Brick> brick;
  bool ours = false;
  {
    const std::lock_guard lock(shard.mutex);
    if (const auto found = shard.entries.find(key); found != shard.entries.end()) {
      ++shard.hit_count;
      brick = found->second.brick;
      if (const auto place = found->second.place; place != shard.recent.end()) {
        shard.recent.splice(shard.recent.begin(), shard.recent, place);
      }
    } else {
      ++shard.miss_count;
      shard.repeated_count += shard.dropped.count(key);
      brick = std::make_shared<Brick>();
      shard.entries.emplace(key, Shard::Entry{brick, shard.recent.end()});
      ours = true;
    }
  }
  if (ours) {
    build(shard, key, *brick);
  } else {
    brick->wait();
  }
  return {brick, brick->values.get()};
}

// Waiting cannot deadlock. A thread that computes a brick never waits for another one: build_
// requests none. isolated() keeps the thread, while it waits for subtasks of build_, from running
// an unrelated task that requests a brick, perhaps the one under construction below on the same
// stack. For the same reason no lock is held while computing.
void BrickCache::build(Shard& shard, const BrickKey& key, Brick& brick) {
  try {
    brick.values = std::make_unique_for_overwrite<float[]>(brick_values_);
    const auto begin = std::chrono::steady_clock::now();
    isolated([&] { build_(key, {brick.values.get(), brick_values_}); });
    const std::chrono::nanoseconds spent = std::chrono::steady_clock::now() - begin;
    total_->nanoseconds += static_cast<std::uint64_t>(spent.count());
    keep(shard, key);
  } catch (...) {
    brick.failure = std::current_exception();
    {
      const std::lock_guard lock(shard.mutex);
      shard.drop(key);  // the next request tries again
    }
    brick.finish(Brick::failed);
    throw;
  }
  brick.finish(Brick::ready);
}

// Adds a finished brick and evicts the least recently used ones beyond the limit.
void BrickCache::keep(Shard& shard, const BrickKey& key) {
  const std::lock_guard lock(shard.mutex);
  if (bricks_per_shard_ == 0) {
    shard.drop(key);
    return;
  }
  while (shard.recent.size() >= bricks_per_shard_) {
    shard.drop(shard.recent.back());
    shard.recent.pop_back();
    total_->resident_bytes -= brick_bytes_;
  }
  shard.recent.push_front(key);
  shard.entries.at(key).place = shard.recent.begin();
  total_->add(brick_bytes_);
}

CacheStats BrickCache::stats() const {
  CacheStats stats;
  for (const Shard& shard : shards_) {
    const std::lock_guard lock(shard.mutex);
    stats.hit_count += shard.hit_count;
    stats.miss_count += shard.miss_count;
    stats.brick_count += shard.miss_count - shard.repeated_count;
  }
  stats.resident_bytes = total_->resident_bytes;
  stats.peak_bytes = total_->peak_bytes;
  stats.brick_nanoseconds = total_->nanoseconds;
  return stats;
}

}  // namespace solidtex::engine
