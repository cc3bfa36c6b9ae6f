// Handles: references, parameters, error callbacks, threads, statistics.
#include <solidtex/solidtex.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <set>
#include <solidtex/solidtex.hpp>
#include <string>
#include <thread>
#include <vector>

#include "catch.hpp"
#include "tiny_model.h"

namespace {

std::uint64_t integer(const solidtex_texture* texture, const char* name) {
  std::uint64_t value = 99;
  CHECK(solidtex_get_integer(texture, name, &value) == SOLIDTEX_OK);
  return value;
}

std::string string(const solidtex_texture* texture, const char* name) {
  const char* value = nullptr;
  CHECK(solidtex_get_string(texture, name, &value) == SOLIDTEX_OK);
  return value;
}

std::vector<float> scattered_values(const solidtex::texture& texture) {
  std::vector<float> points(3 * 5000);
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i] = static_cast<float>((i * 7919) % 1009) * 0.21f;
  std::vector<float> values(5000 * texture.channel_count());
  texture.eval_points({}, points, values);
  return values;
}

}  // namespace

TEST_CASE("handles: parameters have their defaults, keep what is set, and hold", "[handles]") {
  solidtex_texture* texture = solidtex_new();
  CHECK(integer(texture, "seed") == 0);
  CHECK(integer(texture, "cache_limit_bytes") == 256u << 20);
  CHECK(integer(texture, "threads") == 0);
  CHECK(string(texture, "precision") == "full");
  CHECK(solidtex_set_integer(texture, "seed", UINT64_MAX) == SOLIDTEX_OK);
  CHECK(solidtex_set_integer(texture, "cache_limit_bytes", 0) == SOLIDTEX_OK);
  CHECK(solidtex_set_string(texture, "precision", "fast") == SOLIDTEX_OK);
  const auto bytes = tiny_lattice_file();
  REQUIRE(solidtex_open_memory(texture, bytes.data(), bytes.size()) == SOLIDTEX_OK);
  CHECK(integer(texture, "seed") == UINT64_MAX);
  CHECK(string(texture, "precision") == "fast");
  const float point[3] = {1, 2, 3};
  float values[2], other[2];
  REQUIRE(solidtex_eval_points(texture, nullptr, point, 1, values, nullptr) == SOLIDTEX_OK);
  solidtex_statistics statistics = {};
  statistics.struct_size = sizeof statistics;
  REQUIRE(solidtex_get_statistics(texture, &statistics) == SOLIDTEX_OK);
  CHECK(statistics.peak_bytes == 0);
  solidtex::texture::from_memory(bytes).eval_points({}, point, other);
  CHECK(values[0] != other[0]);
  solidtex_release(texture);
}

TEST_CASE("handles: the last reference frees, from any thread", "[handles]") {
  const auto bytes = tiny_sampler_file();
  solidtex_texture* texture = solidtex_new();
  REQUIRE(solidtex_open_memory(texture, bytes.data(), bytes.size()) == SOLIDTEX_OK);
  std::vector<std::thread> threads;
  std::atomic<int> right = 0;
  for (int i = 0; i < 4; ++i) {
    solidtex_retain(texture);
    threads.emplace_back([&, texture] {
      const float point[3] = {1, 2, 3};
      float values[3];
      for (int j = 0; j < 100; ++j) {
        solidtex_retain(texture);
        right += solidtex_eval_points(texture, nullptr, point, 1, values, nullptr) == SOLIDTEX_OK;
        solidtex_release(texture);
      }
      solidtex_release(texture);
    });
  }
  solidtex_release(texture);
  for (std::thread& thread : threads) thread.join();
  CHECK(right == 400);
}

TEST_CASE("handles: the error callback runs for every error of its texture and for no other",
          "[handles]") {
  struct Host {
    std::vector<std::string> reported;
    static void callback(void* user, solidtex_status status, const char* message) {
      static_cast<Host*>(user)->reported.push_back(std::to_string(status) + " " + message);
    }
  } host;
  solidtex_texture* texture = solidtex_new();
  REQUIRE(solidtex_set_error_callback(texture, Host::callback, &host) == SOLIDTEX_OK);
  CHECK(solidtex_open(texture, "no/such.solidtex") == SOLIDTEX_IO_ERROR);
  REQUIRE(host.reported.size() == 1);
  CHECK(host.reported[0].find("2 no/such.solidtex") == 0);
  CHECK(solidtex_set_integer(texture, "sed", 1) == SOLIDTEX_INVALID_ARGUMENT);
  CHECK(solidtex_channel_count(texture) == 0);
  REQUIRE(host.reported.size() == 3);
  CHECK(host.reported[2] == "1 texture is not open");
  // The thread keeps its first message.
  CHECK(std::string(solidtex_error_message()).find("no/such.solidtex") != std::string::npos);
  const auto bytes = tiny_sampler_file();
  CHECK(solidtex_open_memory(texture, bytes.data(), bytes.size()) == SOLIDTEX_OK);
  CHECK(solidtex_channel_count(nullptr) == 0);
  CHECK(host.reported.size() == 3);
  CHECK(solidtex_channel_name(texture, 7) == nullptr);
  CHECK(host.reported.back() == "1 channel is 7, expected less than 3");
  solidtex_clear_error();
  solidtex_release(texture);
}

TEST_CASE("handles: threads change no bit, the caller's arena or the texture's own",
          "[handles][threads]") {
  for (const auto& bytes : {tiny_lattice_file(), tiny_sampler_file()}) {
    const auto expected = scattered_values(solidtex::texture::from_memory(bytes));
    for (const std::uint64_t threads : {1, 2, 5}) {
      const auto texture = solidtex::texture::from_memory(bytes, {.threads = threads});
      CHECK(scattered_values(texture) == expected);
      // More callers than threads.
      std::atomic<int> wrong = 0;
      std::vector<std::thread> callers;
      for (int i = 0; i < 4; ++i)
        callers.emplace_back([&] { wrong += scattered_values(texture) != expected; });
      for (std::thread& caller : callers) caller.join();
      CHECK(wrong == 0);
    }
    const auto texture = solidtex::texture::from_memory(bytes);
    tbb::task_arena(2).execute([&] { CHECK(scattered_values(texture) == expected); });
  }
}

TEST_CASE("handles: a query in an arena of its own is cancelled and fails like others",
          "[handles][threads]") {
  const auto bytes = tiny_lattice_file();
  int calls = 0;
  const auto texture =
      solidtex::texture::from_memory(bytes, {.threads = 2, .progress_callback = [&](double done) {
                                               ++calls;
                                               return done >= 0;
                                             }});
  std::vector<float> values(128 * 128 * 128 * 2);
  try {
    texture.eval_box({0, 0, 0}, {128, 128, 128}, values);
    FAIL("no exception");
  } catch (const solidtex::error& error) {
    CHECK(error.status() == SOLIDTEX_CANCELLED);
  }
  CHECK(calls == 1);
  CHECK_THROWS_AS(texture.eval_box({INT64_MAX, 0, 0}, {1, 1, 1}, std::span(values).first(2)),
                  solidtex::error);
}

TEST_CASE("handles: copies share a texture", "[handles]") {
  std::vector<float> expected;
  std::vector<solidtex::texture> kept;
  {
    const auto texture = solidtex::texture::from_memory(tiny_lattice_file(), {.seed = 3});
    expected = scattered_values(texture);
    kept.push_back(texture);
    CHECK(kept[0].handle() == texture.handle());
  }
  CHECK(scattered_values(kept[0]) == expected);
  CHECK(kept[0].statistics().point_count == 10000);
}

TEST_CASE("handles: statistics count evaluated points and voxels", "[handles]") {
  for (const auto& bytes : {tiny_lattice_file(), tiny_sampler_file()}) {
    const auto texture = solidtex::texture::from_memory(bytes);
    const std::size_t channels = texture.channel_count();
    std::vector<float> values(24 * channels);
    texture.eval_box({0, 0, 0}, {2, 3, 4}, values);
    texture.eval_box({0, 0, 0}, {0, 3, 4}, {});
    CHECK_THROWS_AS(texture.eval_points({1e300, 0, 0}, std::vector<float>(72), values),
                    solidtex::error);
    CHECK(texture.statistics().point_count == 0);
    std::thread([&] { texture.eval_points({}, std::vector<float>(72), values); }).join();
    texture.eval_filtered({}, std::vector<float>(3), std::vector<float>(1, 2.0f),
                          std::span(values).first(channels));
    const solidtex_statistics found = texture.statistics();
    CHECK(found.voxel_count == 24);
    CHECK(found.point_count == 25);
    CHECK((found.brick_nanoseconds > 0) == (texture.family() == SOLIDTEX_FAMILY_LATTICE));
  }
}

TEST_CASE("handles: statistics count the scratch memory of queries", "[handles]") {
  for (const auto& bytes : {tiny_lattice_file(), tiny_sampler_file()}) {
    const auto texture = solidtex::texture::from_memory(bytes);
    CHECK(texture.statistics().peak_scratch_bytes == 0);
    const std::size_t count = 100000;
    std::vector<float> points(3 * count), radii(count, 3.0f);
    for (std::size_t i = 0; i < points.size(); ++i) points[i] = static_cast<float>(i % 64);
    std::vector<float> values(count * texture.channel_count());
    texture.eval_filtered({}, points, radii, values);
    const solidtex_statistics found = texture.statistics();
    CHECK(found.peak_scratch_bytes > 8 * count);  // at least an index for each point
    CHECK(found.peak_scratch_bytes > found.scratch_bytes);
    // Threads of the lattice family keep planes; nothing is left of the points.
    CHECK((found.scratch_bytes > 0) == (texture.family() == SOLIDTEX_FAMILY_LATTICE));
    CHECK(found.scratch_bytes % 4096 == 0);
  }
}
