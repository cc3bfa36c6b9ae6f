// Bounded cache of bricks, sharded by hash. Each brick is computed once, however many threads
// request it at the same time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace solidtex::engine {

struct CacheStats {
  std::uint64_t hit_count = 0, miss_count = 0, resident_bytes = 0, peak_bytes = 0;
  std::uint64_t brick_count = 0;        // distinct bricks; fewer than misses after evictions
  std::uint64_t brick_nanoseconds = 0;  // time spent computing, summed over threads

  CacheStats& operator+=(const CacheStats& other) {
    hit_count += other.hit_count, miss_count += other.miss_count;
    resident_bytes += other.resident_bytes, peak_bytes += other.peak_bytes;
    brick_count += other.brick_count, brick_nanoseconds += other.brick_nanoseconds;
    return *this;
  }
};

// Index of a brick on the absolute lattice of bricks.
struct BrickKey {
  std::int32_t x = 0, y = 0, z = 0;
  friend auto operator<=>(const BrickKey&, const BrickKey&) = default;
};

class BrickCache {
 public:
  // Computes a brick. Called without any lock held.
  using Build = std::function<void(const BrickKey& key, std::span<float> values)>;

  // Keeps at most limit_bytes of finished bricks. Bricks in use or under construction are not
  // counted; there is at most one per thread.
  BrickCache(std::size_t brick_values, std::uint64_t limit_bytes, Build build);
  ~BrickCache();

  // Returns a brick, computed now if necessary. The values live as long as the pointer, even if the
  // cache evicts the brick.
  std::shared_ptr<const float> get(const BrickKey& key);

  CacheStats stats() const;

 private:
  struct Brick;
  struct Shard;

  Shard& shard_of(const BrickKey& key);
  void build(Shard& shard, const BrickKey& key, Brick& brick);
  void keep(Shard& shard, const BrickKey& key);

  std::size_t brick_values_;
  std::uint64_t brick_bytes_;
  Build build_;
  std::vector<Shard> shards_;
  std::size_t bricks_per_shard_;
  struct Total;
  std::unique_ptr<Total> total_;
};

}  // namespace solidtex::engine
