// Crop windows, progressive passes and adaptive sampling.
#include <algorithm>
#include <atomic>
#include <cmath>

#include "catch.hpp"
#include "tests/scenes/support.h"

using namespace scene_tests;

namespace {

// A sphere: smooth on top, noisy where only a small bright light reaches it, under a constant sky.
pt::Scene half_easy_scene() {
  pt::Scene scene = make_scene(make_sphere(24), {}, {0, 0, 5}, 40);
  scene.environment = uniform_light({0.3f, 0.3f, 0.3f});
  scene.lights.push_back({{-2, -2, 3}, {0, 0.3f, 0}, {0.3f, 0, 0}, glm::vec3(150)});
  return scene;
}

pt::AovImage finish(const pt::Scene& scene, const pt::RenderSettings& settings) {
  pt::Renderer renderer(scene, settings);
  CHECK(renderer.render());
  CHECK(renderer.remaining_samples() == 0);
  return renderer.image();
}

pt::RenderSettings adaptive_settings() {
  pt::RenderSettings settings = small_settings(48, 512);  // several tiles, some partial
  settings.height = 40;
  settings.aovs = {pt::Aov::beauty, pt::Aov::samples, pt::Aov::variance};
  settings.noise = 0.03;
  return settings;
}

bool is_part_of(const pt::AovImage& part, const pt::AovImage& whole, pt::Aov aov) {
  const std::size_t channels = pt::info(aov).channels.size();
  const auto row = static_cast<std::size_t>(part.window.width()) * channels;
  for (int y = part.window.y0; y < part.window.y1; ++y) {
    const auto from = static_cast<std::size_t>(y - part.window.y0) * row;
    const auto to = static_cast<std::size_t>(y * whole.width + part.window.x0) * channels;
    const auto& a = part.values(aov);
    const auto& b = whole.values(aov);
    if (!std::equal(a.begin() + static_cast<std::ptrdiff_t>(from),
                    a.begin() + static_cast<std::ptrdiff_t>(from + row),
                    b.begin() + static_cast<std::ptrdiff_t>(to))) {
      return false;
    }
  }
  return true;
}

}  // namespace

TEST_CASE("A crop has the bits of the full image, also with a noise target") {
  const pt::Scene scene = half_easy_scene();
  pt::RenderSettings settings = adaptive_settings();
  settings.samples = 64;
  for (const double noise : {0.0, 0.03}) {
    settings.noise = noise;
    settings.crop = {};
    const pt::AovImage whole = finish(scene, settings);
    for (const pt::Window& crop : {pt::Window{0, 0, 48, 1}, {13, 7, 40, 33}, {47, 39, 48, 40}}) {
      settings.crop = crop;
      const pt::AovImage part = finish(scene, settings);
      CAPTURE(noise, crop.x0);
      CHECK(part.window == crop);
      for (const auto& plane : part.planes) CHECK(is_part_of(part, whole, plane.aov));
    }
  }
}

TEST_CASE("Progressive passes and stops do not change the bits") {
  const pt::Scene scene = half_easy_scene();
  pt::RenderSettings settings = adaptive_settings();
  settings.samples = 100;
  for (const double noise : {0.0, 0.03}) {
    settings.noise = noise;
    settings.progressive = false;
    const pt::AovImage whole = finish(scene, settings);
    settings.progressive = true;
    settings.threads = 4;
    pt::Renderer renderer(scene, settings);
    int stops = 0;
    std::atomic<int> asked = 0;
    while (!renderer.render({{}, [&] { return ++asked % 7 == 0; }})) ++stops;
    CHECK(stops > 3);
    const pt::AovImage stopped = renderer.image();
    for (const auto& plane : whole.planes) CHECK(plane.values == stopped.values(plane.aov));
  }
}

TEST_CASE("The first progressive passes cover the full image") {
  pt::RenderSettings settings = adaptive_settings();
  settings.noise = 0;
  settings.progressive = true;
  const pt::Scene scene = half_easy_scene();
  pt::Renderer renderer(scene, settings);
  std::atomic<int> asked = 0;
  CHECK(!renderer.render({{}, [&] { return ++asked > 12; }}));
  const std::vector<float> counts = renderer.image().values(pt::Aov::samples);
  CHECK(*std::min_element(counts.begin(), counts.end()) >= 1);
  CHECK(*std::max_element(counts.begin(), counts.end()) <= 8);
}

TEST_CASE("A noise target is met, with more samples in noisy blocks") {
  const pt::Scene scene = half_easy_scene();
  const pt::RenderSettings settings = adaptive_settings();
  const pt::AovImage picture = finish(scene, settings);
  const std::vector<float>& counts = picture.values(pt::Aov::samples);
  const auto at = [&](int x, int y) { return counts[static_cast<std::size_t>(y * 48 + x)]; };
  CHECK(at(2, 2) == 32);  // the sky takes the minimum
  CHECK(*std::max_element(counts.begin(), counts.end()) >= 128);
  double all = 0;
  for (const float count : counts) all += count;
  CHECK(all < 0.5 * 512 * 48 * 40);

  // The reference has many samples in all pixels. In finished blocks the root mean square error
  // meets the target, and the mean of the image is unbiased.
  pt::RenderSettings fine = settings;
  fine.noise = 0;
  fine.samples = 1024;
  fine.seed = 1;
  fine.aovs = {pt::Aov::beauty};
  const std::vector<float> truth = finish(scene, fine).values(pt::Aov::beauty);
  const std::vector<float>& found = picture.values(pt::Aov::beauty);
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

TEST_CASE("With a noise target the bits do not depend on the number of threads") {
  const pt::Scene scene = half_easy_scene();
  pt::RenderSettings settings = adaptive_settings();
  settings.samples = 128;
  settings.threads = 1;
  const pt::AovImage one = finish(scene, settings);
  settings.threads = 4;
  const pt::AovImage four = finish(scene, settings);
  for (const auto& plane : one.planes) CHECK(plane.values == four.values(plane.aov));
}

TEST_CASE("Invalid settings are refused") {
  const pt::Scene scene = half_easy_scene();
  pt::RenderSettings settings = small_settings(16, 1);
  settings.crop = {0, 0, 17, 2};
  CHECK_THROWS_AS(pt::Renderer(scene, settings), std::invalid_argument);
  settings.crop = {};
  settings.aovs = {};
  CHECK_THROWS_AS(pt::Renderer(scene, settings), std::invalid_argument);
  settings.aovs = {pt::Aov::beauty};
  settings.noise = -1;
  CHECK_THROWS_AS(pt::Renderer(scene, settings), std::invalid_argument);
}
