// Parts of a picture: crops, passes, and samples where the noise asks for them.
#include <algorithm>
#include <atomic>
#include <cmath>

#include "catch.hpp"
#include "tests/scenes/support.h"

using namespace scene_tests;

namespace {

// A ball, easy on top and hard where only a small bright light reaches it; the sky is one colour.
pt::Scene half_easy_scene() {
  pt::Scene scene = make_scene(make_sphere(24), {}, {0, 0, 5}, 40);
  scene.environment = uniform_light({0.3f, 0.3f, 0.3f});
  scene.lights.push_back({{-2, -2, 3}, {0, 0.3f, 0}, {0.3f, 0, 0}, glm::vec3(150)});
  return scene;
}

pt::Picture finish(const pt::Scene& scene, const pt::RenderSettings& settings) {
  pt::Rendering rendering(scene, settings);
  CHECK(rendering.go_on());
  CHECK(rendering.samples_left() == 0);
  return rendering.picture();
}

pt::RenderSettings adaptive_settings() {
  pt::RenderSettings settings = small_settings(48, 512);  // several tiles, some of them cut
  settings.height = 40;
  settings.layers = {pt::Layer::beauty, pt::Layer::samples, pt::Layer::variance};
  settings.noise = 0.03;
  return settings;
}

bool is_part_of(const pt::Picture& part, const pt::Picture& whole, pt::Layer layer) {
  const std::size_t channels = pt::info(layer).channels.size();
  const auto row = static_cast<std::size_t>(part.window.width()) * channels;
  for (int y = part.window.y0; y < part.window.y1; ++y) {
    const auto from = static_cast<std::size_t>(y - part.window.y0) * row;
    const auto to = static_cast<std::size_t>(y * whole.width + part.window.x0) * channels;
    const auto& a = part.values(layer);
    const auto& b = whole.values(layer);
    if (!std::equal(a.begin() + static_cast<std::ptrdiff_t>(from),
                    a.begin() + static_cast<std::ptrdiff_t>(from + row),
                    b.begin() + static_cast<std::ptrdiff_t>(to))) {
      return false;
    }
  }
  return true;
}

}  // namespace

TEST_CASE("A crop has the bits of the whole picture, with a noise target, too") {
  const pt::Scene scene = half_easy_scene();
  pt::RenderSettings settings = adaptive_settings();
  settings.samples = 64;
  for (const double noise : {0.0, 0.03}) {
    settings.noise = noise;
    settings.crop = {};
    const pt::Picture whole = finish(scene, settings);
    for (const pt::Window& crop : {pt::Window{0, 0, 48, 1}, {13, 7, 40, 33}, {47, 39, 48, 40}}) {
      settings.crop = crop;
      const pt::Picture part = finish(scene, settings);
      CAPTURE(noise, crop.x0);
      CHECK(part.window == crop);
      for (const auto& plane : part.planes) CHECK(is_part_of(part, whole, plane.layer));
    }
  }
}

TEST_CASE("Passes over the picture and stops in between do not show") {
  const pt::Scene scene = half_easy_scene();
  pt::RenderSettings settings = adaptive_settings();
  settings.samples = 100;
  for (const double noise : {0.0, 0.03}) {
    settings.noise = noise;
    settings.progressive = false;
    const pt::Picture whole = finish(scene, settings);
    settings.progressive = true;
    settings.threads = 4;
    pt::Rendering rendering(scene, settings);
    int stops = 0;
    std::atomic<int> asked = 0;
    while (!rendering.go_on({{}, [&] { return ++asked % 7 == 0; }})) ++stops;
    CHECK(stops > 3);
    const pt::Picture stopped = rendering.picture();
    for (const auto& plane : whole.planes) CHECK(plane.values == stopped.values(plane.layer));
  }
}

TEST_CASE("The first passes reach the whole picture") {
  pt::RenderSettings settings = adaptive_settings();
  settings.noise = 0;
  settings.progressive = true;
  const pt::Scene scene = half_easy_scene();
  pt::Rendering rendering(scene, settings);
  std::atomic<int> asked = 0;
  CHECK(!rendering.go_on({{}, [&] { return ++asked > 12; }}));
  const std::vector<float> counts = rendering.picture().values(pt::Layer::samples);
  CHECK(*std::min_element(counts.begin(), counts.end()) >= 1);
  CHECK(*std::max_element(counts.begin(), counts.end()) <= 8);
}

TEST_CASE("A noise target spends samples where they are needed, and is met") {
  const pt::Scene scene = half_easy_scene();
  const pt::RenderSettings settings = adaptive_settings();
  const pt::Picture picture = finish(scene, settings);
  const std::vector<float>& counts = picture.values(pt::Layer::samples);
  const auto at = [&](int x, int y) { return counts[static_cast<std::size_t>(y * 48 + x)]; };
  CHECK(at(2, 2) == 32);  // the sky needs the least there is
  CHECK(*std::max_element(counts.begin(), counts.end()) >= 128);
  double all = 0;
  for (const float count : counts) all += count;
  CHECK(all < 0.5 * 512 * 48 * 40);

  // The truth: many samples for all. Where the target was met the error is as promised, of blocks'
  // pixels at large; the mean of the picture is right.
  pt::RenderSettings fine = settings;
  fine.noise = 0;
  fine.samples = 1024;
  fine.seed = 1;
  fine.layers = {pt::Layer::beauty};
  const std::vector<float> truth = finish(scene, fine).values(pt::Layer::beauty);
  const std::vector<float>& found = picture.values(pt::Layer::beauty);
  double squares = 0, expected = 0, sum = 0, true_sum = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    squares += (found[i] - truth[i]) * (found[i] - truth[i]);
    expected += std::pow(0.03 * std::max(truth[i], 0.01f), 2);
    sum += found[i];
    true_sum += truth[i];
  }
  CAPTURE(std::sqrt(squares / expected), sum / true_sum, all / (48 * 40));
  CHECK(squares < 2 * expected);
  CHECK(sum == Approx(true_sum).epsilon(0.002));
}

TEST_CASE("With a noise target the same bits come from any number of threads") {
  const pt::Scene scene = half_easy_scene();
  pt::RenderSettings settings = adaptive_settings();
  settings.samples = 128;
  settings.threads = 1;
  const pt::Picture one = finish(scene, settings);
  settings.threads = 4;
  const pt::Picture four = finish(scene, settings);
  for (const auto& plane : one.planes) CHECK(plane.values == four.values(plane.layer));
}

TEST_CASE("Settings that make no picture are refused") {
  const pt::Scene scene = half_easy_scene();
  pt::RenderSettings settings = small_settings(16, 1);
  settings.crop = {0, 0, 17, 2};
  CHECK_THROWS_AS(pt::Rendering(scene, settings), std::invalid_argument);
  settings.crop = {};
  settings.layers = {};
  CHECK_THROWS_AS(pt::Rendering(scene, settings), std::invalid_argument);
  settings.layers = {pt::Layer::beauty};
  settings.noise = -1;
  CHECK_THROWS_AS(pt::Rendering(scene, settings), std::invalid_argument);
}
