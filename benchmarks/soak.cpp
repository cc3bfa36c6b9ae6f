// Load: many threads and one texture whose cache is small, or one thread and coordinates that grow.
//   solidtex_soak mixed MODEL   [--threads N] [--queries N]: compared with a serial run
//   solidtex_soak walk MODEL    [--seconds N]: look-ups farther and farther away
// Prints figures as JSON. benchmarks/soak.py runs it. Exit code: 1 for a finding.
#include <solidtex/solidtex.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::ordered_json;

constexpr int kSeeds = 4;
constexpr std::size_t kMaxPoints = 16;
constexpr std::int64_t kMaxEdge = 4;
constexpr std::uint64_t kSampled = 1009;  // every so many queries are kept and compared
constexpr float kRegion = 96;             // edge of the working set, in texels

// An open texture with a seed and a cache limit.
class Texture {
 public:
  Texture(const std::string& model, std::uint64_t seed, std::uint64_t cache_limit)
      : texture_(solidtex_new()) {
    require(solidtex_set_integer(texture_, "seed", seed));
    if (cache_limit > 0) require(solidtex_set_integer(texture_, "cache_limit_bytes", cache_limit));
    require(solidtex_set_integer(texture_, "threads", 1));
    require(solidtex_open(texture_, model.c_str()));
  }
  ~Texture() { solidtex_release(texture_); }
  Texture(const Texture&) = delete;

  static void require(solidtex_status status) {
    if (status != SOLIDTEX_OK) throw std::runtime_error(solidtex_error_message());
  }
  solidtex_texture* get() const { return texture_; }
  std::size_t channels() const { return solidtex_channel_count(texture_); }
  solidtex_statistics statistics() const {
    solidtex_statistics found = {};
    found.struct_size = sizeof found;
    require(solidtex_get_statistics(texture_, &found));
    return found;
  }

 private:
  solidtex_texture* texture_;
};

// Query `number`: points, a box, jacobians or footprints, at a place that its number decides.
class Query {
 public:
  Query(std::uint64_t number) : number_(number) {
    std::mt19937_64 random(number * 0x9E3779B97F4A7C15u + 1);
    std::uniform_real_distribution<float> place(0, kRegion);
    for (int axis = 0; axis < 3; ++axis) {
      box_origin_[axis] = static_cast<std::int64_t>(place(random));
      box_size_[axis] = 1 + static_cast<std::int64_t>(random() % kMaxEdge);
    }
    count_ = 1 + random() % kMaxPoints;
    for (float& coordinate : points_) coordinate = place(random);
    for (float& radius : radii_) radius = static_cast<float>(random() % 1000) * 0.008f;
  }

  std::size_t seed_index() const { return number_ / 4 % kSeeds; }

  // Writes the values to `values`, at least max_size(channels) floats. Returns how many.
  std::size_t run(const Texture& texture, float* values) const {
    const std::size_t channels = texture.channels();
    if (number_ % 4 == 0) {
      Texture::require(solidtex_eval_box(texture.get(), box_origin_, box_size_, values));
      return channels * static_cast<std::size_t>(box_size_[0] * box_size_[1] * box_size_[2]);
    }
    solidtex_footprints footprints = {};
    footprints.struct_size = sizeof footprints;
    footprints.radii = radii_.data();
    const bool has_jacobians = number_ % 4 == 2;
    const std::size_t row = channels * count_;
    Texture::require(solidtex_eval(texture.get(), nullptr, points_.data(),
                                   number_ % 4 == 3 ? &footprints : nullptr, count_, values,
                                   has_jacobians ? values + row : nullptr));
    return has_jacobians ? 4 * row : row;
  }

  static std::size_t max_size(std::size_t channels) {
    return channels *
           std::max(4 * kMaxPoints, static_cast<std::size_t>(kMaxEdge * kMaxEdge * kMaxEdge));
  }

 private:
  std::uint64_t number_;
  std::int64_t box_origin_[3], box_size_[3];
  std::size_t count_;
  std::array<float, 3 * kMaxPoints> points_;
  std::array<float, kMaxPoints> radii_;
};

std::uint64_t hash_of(const float* values, std::size_t count) {
  std::uint64_t hash = count;
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, values + i, sizeof bits);
    hash = (hash ^ bits) * 0x100000001B3u;
  }
  return hash;
}

std::uint64_t peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) << 10;
}

std::uint64_t memory_now() {
  std::ifstream file("/proc/self/statm");
  std::uint64_t pages = 0, resident = 0;
  file >> pages >> resident;
  return resident * 4096;
}

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// Memory of the whole working set of one seed: that of a cache without a limit.
std::uint64_t working_set(const std::string& model) {
  const Texture whole(model, 0, std::uint64_t{1} << 40);
  std::vector<float> values(Query::max_size(whole.channels()));
  for (std::uint64_t number = 0; number < 1000; ++number) Query(number).run(whole, values.data());
  return whole.statistics().peak_bytes;
}

int mixed(const std::string& model, int threads, std::uint64_t queries) {
  const std::uint64_t set = working_set(model);
  const std::uint64_t limit = std::max<std::uint64_t>(set / 100, 1);
  std::vector<std::unique_ptr<Texture>> textures;
  for (int seed = 0; seed < kSeeds; ++seed)
    textures.push_back(std::make_unique<Texture>(model, seed, limit));
  std::vector<std::uint64_t> hashes(queries / kSampled + 1);
  std::atomic<std::uint64_t> next = 0, failures = 0;
  const auto begin = Clock::now();
  std::vector<std::thread> workers;
  for (int i = 0; i < threads; ++i)
    workers.emplace_back([&] {
      std::vector<float> values(Query::max_size(textures[0]->channels()));
      try {
        for (std::uint64_t number = next++; number < queries; number = next++) {
          const Query query(number);
          const std::size_t count = query.run(*textures[query.seed_index()], values.data());
          if (number % kSampled == 0) hashes[number / kSampled] = hash_of(values.data(), count);
        }
      } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        ++failures;
      }
    });
  for (std::thread& worker : workers) worker.join();
  const double seconds = seconds_since(begin);
  std::uint64_t different = 0, compared = 0;
  for (std::uint64_t number = 0; number < queries; number += kSampled, ++compared) {
    const Query query(number);
    static const Texture serial[kSeeds] = {
        {model, 0, 0}, {model, 1, 0}, {model, 2, 0}, {model, 3, 0}};
    std::vector<float> values(Query::max_size(serial[0].channels()));
    const std::size_t count = query.run(serial[query.seed_index()], values.data());
    different += hash_of(values.data(), count) != hashes[number / kSampled];
  }
  const ordered_json found = {{"threads", threads},
                              {"queries", queries},
                              {"seconds", seconds},
                              {"working_set_bytes", set},
                              {"cache_limit_bytes", limit},
                              {"peak_cache_bytes", textures[0]->statistics().peak_bytes},
                              {"peak_memory_bytes", peak_memory()},
                              {"compared", compared},
                              {"different", different},
                              {"failures", failures.load()}};
  std::printf("%s\n", found.dump().c_str());
  return different == 0 && failures == 0 ? 0 : 1;
}

// Points that go away from the origin, so that no brick is needed twice.
int walk(const std::string& model, double seconds) {
  const Texture texture(model, 0, std::uint64_t{4} << 20);
  std::vector<float> values(Query::max_size(texture.channels()));
  std::array<float, 3 * kMaxPoints> points;
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = static_cast<float>(i * 7919 % 64);
  std::vector<std::uint64_t> memory;
  std::uint64_t lookups = 0;
  double origin[3] = {0, 0, 0};
  const auto begin = Clock::now();
  for (int part = 1; part <= 10; ++part) {
    while (seconds_since(begin) < seconds * part / 10) {
      Texture::require(solidtex_eval(texture.get(), origin, points.data(), nullptr, kMaxPoints,
                                     values.data(), nullptr));
      lookups += kMaxPoints;
      origin[0] += 16;
      origin[1] -= 5;
      origin[2] += 3;
    }
    memory.push_back(memory_now());
  }
  const std::uint64_t grown = memory.back() - std::min(memory.back(), memory[1]);
  const ordered_json found = {{"seconds", seconds_since(begin)},
                              {"lookups", lookups},
                              {"farthest", origin[0]},
                              {"memory_bytes", memory},
                              {"grown_bytes", grown}};
  std::printf("%s\n", found.dump().c_str());
  return grown <= (1u << 20) ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Loads one texture with queries.", "solidtex_soak");
  std::string kind, model;
  int threads = 64;
  std::uint64_t queries = 1'000'000;
  double seconds = 60;
  app.add_option("kind", kind)->required()->check(CLI::IsMember({"mixed", "walk"}));
  app.add_option("model", model)->required();
  app.add_option("--threads", threads, "threads of mixed queries (default 64)");
  app.add_option("--queries", queries, "all together (default 1000000)");
  app.add_option("--seconds", seconds, "length of a walk (default 60)");
  CLI11_PARSE(app, argc, argv);
  try {
    return kind == "walk" ? walk(model, seconds) : mixed(model, threads, queries);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "solidtex_soak: %s\n", error.what());
    return 1;
  }
}
