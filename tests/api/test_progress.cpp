// Progress: the callback runs on the querying thread and cancels queries.
#include <solidtex/solidtex.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "catch.hpp"
#include "tiny_model.h"

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr int64_t kOrigin[3] = {-5, 7, 1000}, kSize[3] = {300, 70, 70};

struct Host {
  int stop_at = 0;  // the number of the call that is answered with "stop", 0 for none
  std::vector<double> reported = {};
  bool on_other_thread = false;
  std::thread::id thread = std::this_thread::get_id();

  static int callback(void* user, double done) {
    Host& host = *static_cast<Host*>(user);
    host.on_other_thread |= std::this_thread::get_id() != host.thread;
    host.reported.push_back(done);
    return static_cast<int>(host.reported.size()) == host.stop_at;
  }
};

struct Opened {
  solidtex_texture* texture = solidtex_new();
  explicit Opened(const std::vector<std::byte>& bytes, Host* host = nullptr) {
    // The thread's last report of another query must be long enough ago.
    if (host) std::this_thread::sleep_for(std::chrono::milliseconds(60));
    solidtex_set_progress_callback(texture, host ? Host::callback : nullptr, host);
    REQUIRE(solidtex_open_memory(texture, bytes.data(), bytes.size()) == SOLIDTEX_OK);
    solidtex_clear_error();
  }
  ~Opened() { solidtex_release(texture); }

  std::vector<float> room(std::size_t count) const {
    return std::vector<float>(count * solidtex_channel_count(texture), kNan);
  }
  solidtex_status box(std::vector<float>& values) const {
    values = room(static_cast<std::size_t>(kSize[0] * kSize[1] * kSize[2]));
    return solidtex_eval_box(texture, kOrigin, kSize, values.data());
  }
  // Queries with or without footprints, in a cube of many bricks.
  solidtex_status points(std::vector<float>& values, float radius = 0) const {
    std::vector<float> places(3 * 40000);
    for (std::size_t i = 0; i < places.size(); ++i)
      places[i] = static_cast<float>((i * 7919) % 1009) * 0.37f;
    const std::size_t count = places.size() / 3;
    values = room(count);
    if (radius == 0)
      return solidtex_eval_points(texture, nullptr, places.data(), count, values.data(), nullptr);
    std::vector<float> radii(count, radius);
    radii[7] = 0;
    return solidtex_eval_filtered(texture, nullptr, places.data(), radii.data(), count,
                                  values.data(), nullptr);
  }
};

std::size_t unwritten(const std::vector<float>& values) {
  return static_cast<std::size_t>(
      std::count_if(values.begin(), values.end(), [](float v) { return std::isnan(v); }));
}

bool stopped(solidtex_status status) {
  const std::string message = solidtex_error_message();
  solidtex_clear_error();
  return status == SOLIDTEX_CANCELLED && message.find("stopped") != std::string::npos;
}

}  // namespace

TEST_CASE("progress: a cancelled query returns its status and leaves work undone", "[progress]") {
  const auto bytes =
      GENERATE(as<std::vector<std::byte>>{}, tiny_lattice_file(), tiny_sampler_file());
  for (const bool box : {true, false}) {
    Host host{.stop_at = 1};
    const Opened opened(bytes, &host);
    std::vector<float> values;
    CHECK(stopped(box ? opened.box(values) : opened.points(values)));
    CHECK(unwritten(values) > 0);
    CHECK(host.reported == std::vector<double>{0});
    CHECK_FALSE(host.on_other_thread);
  }
}

TEST_CASE("progress: the callback changes no bit, and progress never decreases", "[progress]") {
  const auto bytes =
      GENERATE(as<std::vector<std::byte>>{}, tiny_lattice_file(), tiny_sampler_file());
  const float radius = GENERATE(0.0f, 3.0f, 20.0f);
  const Opened silent(bytes);
  std::vector<float> expected, values;
  REQUIRE(silent.points(expected, radius) == SOLIDTEX_OK);
  REQUIRE(unwritten(expected) == 0);

  Host host;
  const Opened opened(bytes, &host);
  CHECK(opened.points(values, radius) == SOLIDTEX_OK);
  CHECK(values == expected);
  REQUIRE(!host.reported.empty());
  CHECK(std::is_sorted(host.reported.begin(), host.reported.end()));
  CHECK(host.reported.front() >= 0);
  CHECK(host.reported.back() <= 1);
  CHECK_FALSE(host.on_other_thread);
}

TEST_CASE("progress: a long query is cancelled on its way", "[progress]") {
  Host host{.stop_at = 4};
  const Opened opened(tiny_sampler_file(), &host);
  std::vector<float> values;
  solidtex_status status = SOLIDTEX_OK;
  // Until a box is large enough for this machine.
  for (int64_t edge = 128; status == SOLIDTEX_OK && edge <= 1024; edge *= 2) {
    host.reported.clear();
    const int64_t size[3] = {edge, edge, 128};
    values = opened.room(static_cast<std::size_t>(edge * edge * 128));
    status = solidtex_eval_box(opened.texture, kOrigin, size, values.data());
  }
  CHECK(stopped(status));
  REQUIRE(host.reported.size() == 4);
  CHECK(std::is_sorted(host.reported.begin(), host.reported.end()));
  CHECK(host.reported.back() > 0);
  const double written = 1 - static_cast<double>(unwritten(values)) / double(values.size());
  CHECK(host.reported.back() < written + 0.1);  // cubes at the edges of the box are smaller
}

TEST_CASE("progress: each thread's queries call back on that thread", "[progress]") {
  struct Threads {
    std::thread::id wrong = std::this_thread::get_id();
    std::atomic<int> calls = 0, on_wrong = 0;
    static int callback(void* user, double) {
      auto& threads = *static_cast<Threads*>(user);
      ++threads.calls;
      threads.on_wrong += std::this_thread::get_id() == threads.wrong;
      return 0;
    }
  } threads;
  solidtex_texture* texture = solidtex_new();
  const auto bytes = tiny_lattice_file();
  solidtex_set_progress_callback(texture, Threads::callback, &threads);
  REQUIRE(solidtex_open_memory(texture, bytes.data(), bytes.size()) == SOLIDTEX_OK);
  std::thread([&] {
    std::vector<float> values(static_cast<std::size_t>(kSize[0] * kSize[1] * kSize[2]) * 2);
    solidtex_eval_box(texture, kOrigin, kSize, values.data());
  }).join();
  CHECK(threads.calls > 0);
  CHECK(threads.on_wrong == 0);
  solidtex_release(texture);
}

TEST_CASE("progress: a token cancels its own query, beside the texture's callback", "[progress]") {
  const auto bytes =
      GENERATE(as<std::vector<std::byte>>{}, tiny_lattice_file(), tiny_sampler_file());
  const bool texture_has_one = GENERATE(false, true);
  Host of_texture, of_query{.stop_at = 1};
  const Opened opened(bytes, texture_has_one ? &of_texture : nullptr);
  std::vector<float> expected, values;
  REQUIRE(opened.box(expected) == SOLIDTEX_OK);
  const std::size_t calls_before = of_texture.reported.size();

  solidtex_token token = {sizeof token, Host::callback, &of_query};
  values = opened.room(expected.size() / solidtex_channel_count(opened.texture));
  CHECK(
      stopped(solidtex_eval_box_with_token(opened.texture, kOrigin, kSize, values.data(), &token)));
  CHECK(of_query.reported == std::vector<double>{0});
  CHECK((of_texture.reported.size() > calls_before) == texture_has_one);

  Host patient;
  token.user = &patient;
  CHECK(solidtex_eval_box_with_token(opened.texture, kOrigin, kSize, values.data(), &token) ==
        SOLIDTEX_OK);
  CHECK(values == expected);
  CHECK_FALSE(patient.reported.empty());

  std::vector<float> points(3 * 40000);
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = static_cast<float>(i % 1009) * 0.37f;
  values = opened.room(points.size() / 3);
  Host impatient{.stop_at = 1};
  token.user = &impatient;
  CHECK(stopped(solidtex_eval_with_token(opened.texture, nullptr, points.data(), nullptr,
                                         points.size() / 3, values.data(), nullptr, &token)));
  token.progress_callback = nullptr;  // a token without a callback is none
  CHECK(solidtex_eval_with_token(opened.texture, nullptr, points.data(), nullptr, points.size() / 3,
                                 values.data(), nullptr, &token) == SOLIDTEX_OK);
  token.struct_size = 1;
  CHECK(solidtex_eval_box_with_token(opened.texture, kOrigin, kSize, values.data(), &token) ==
        SOLIDTEX_INVALID_ARGUMENT);
  CHECK(std::string(solidtex_error_message()).find("solidtex_token.struct_size is 1") !=
        std::string::npos);
  solidtex_clear_error();
}
