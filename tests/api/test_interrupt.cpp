// A host stops its queries: it is asked on its own thread, and what it says holds.
#include <solidtex/solidtex.h>

#include <algorithm>
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
  int stop_at = 0;  // the number of the question that is answered with "stop", 0 for none
  int questions = 0;
  bool on_other_thread = false;
  std::thread::id thread = std::this_thread::get_id();

  static int ask(void* user) {
    Host& host = *static_cast<Host*>(user);
    host.on_other_thread |= std::this_thread::get_id() != host.thread;
    return ++host.questions == host.stop_at;
  }
};

struct Opened {
  solidtex_texture* texture = nullptr;
  explicit Opened(const std::vector<std::byte>& bytes) {
    REQUIRE(solidtex_open_memory(bytes.data(), bytes.size(), nullptr, &texture) == SOLIDTEX_OK);
    solidtex_clear_error();
  }
  ~Opened() {
    solidtex_set_interrupt(nullptr, nullptr);
    solidtex_close(texture);
  }

  std::vector<float> room(std::size_t count) const {
    return std::vector<float>(count * solidtex_channel_count(texture), kNan);
  }
  solidtex_status box(std::vector<float>& values) const {
    values = room(static_cast<std::size_t>(kSize[0] * kSize[1] * kSize[2]));
    return solidtex_eval_box(texture, kOrigin, kSize, values.data());
  }
  solidtex_status points(std::vector<float>& values) const {
    std::vector<float> places(3 * 40000);
    for (std::size_t i = 0; i < places.size(); ++i)
      places[i] = static_cast<float>((i * 7919) % 1009) * 0.37f;
    values = room(places.size() / 3);
    return solidtex_eval_points(texture, nullptr, places.data(), places.size() / 3, values.data(),
                                nullptr);
  }
};

std::size_t unwritten(const std::vector<float>& values) {
  return static_cast<std::size_t>(
      std::count_if(values.begin(), values.end(), [](float v) { return std::isnan(v); }));
}

}  // namespace

TEST_CASE("interrupt: a query that is told to stop says so and leaves work undone", "[interrupt]") {
  const auto bytes = GENERATE(as<std::vector<std::byte>>{}, tiny_field_file(), tiny_sampler_file());
  const Opened opened(bytes);
  Host host;
  host.stop_at = 1;
  std::vector<float> values;
  const auto stopped = [&](solidtex_status status) {
    const std::string message = solidtex_error_message();
    solidtex_clear_error();
    return status == SOLIDTEX_CANCELLED && message.find("stopped") != std::string::npos;
  };
  solidtex_set_interrupt(Host::ask, &host);
  CHECK(stopped(opened.box(values)));
  CHECK(unwritten(values) > 0);
  CHECK(host.questions == 1);

  host.questions = 0;
  solidtex_set_interrupt(Host::ask, &host);
  CHECK(stopped(opened.points(values)));
  CHECK(unwritten(values) > 0);
  CHECK_FALSE(host.on_other_thread);
}

TEST_CASE("interrupt: asking changes no bit, and stops with its end", "[interrupt]") {
  const auto bytes = GENERATE(as<std::vector<std::byte>>{}, tiny_field_file(), tiny_sampler_file());
  const Opened opened(bytes);
  std::vector<float> box, points, values;
  REQUIRE(opened.box(box) == SOLIDTEX_OK);
  REQUIRE(opened.points(points) == SOLIDTEX_OK);
  REQUIRE(unwritten(box) + unwritten(points) == 0);

  Host host;
  solidtex_set_interrupt(Host::ask, &host);
  CHECK(opened.box(values) == SOLIDTEX_OK);
  CHECK(values == box);
  CHECK(opened.points(values) == SOLIDTEX_OK);
  CHECK(values == points);
  CHECK(host.questions > 0);
  CHECK_FALSE(host.on_other_thread);

  // Another thread's queries ask nobody.
  Host never;
  never.stop_at = 1;
  solidtex_set_interrupt(Host::ask, &never);
  solidtex_status status = SOLIDTEX_INTERNAL_ERROR;
  std::thread([&] { status = opened.points(values); }).join();
  CHECK(status == SOLIDTEX_OK);
  CHECK(never.questions == 0);

  solidtex_set_interrupt(nullptr, nullptr);
  CHECK(opened.box(values) == SOLIDTEX_OK);
  CHECK(values == box);
  CHECK(never.questions == 0);
}
