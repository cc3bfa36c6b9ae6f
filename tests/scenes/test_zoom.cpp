// A zoom away from a solid texture in small steps: no flicker, no jump between pyramid levels.
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

#include "catch.hpp"
#include "tests/scenes/support.h"

using namespace scene_tests;

namespace {

constexpr int kPixels = 40;
constexpr float kFov = 30;

struct Statistics {
  double mean = 0, deviation = 0;
};

// Contrast of the green albedo of a plane that fills the image, at one sample per pixel.
Statistics seen_at(const std::string& model, double texels_per_pixel, pt::TextureFilter filter) {
  const double per_distance = 2 * std::tan(kFov / 360.0 * std::numbers::pi) / kPixels;
  const auto distance = static_cast<float>(texels_per_pixel / per_distance);
  pt::Material material;
  material.color = pt::SolidColor{0, false, glm::translate(glm::dmat4(1), glm::dvec3(0.5))};
  pt::Scene scene = make_scene(make_quad(distance), material, {0, distance, 0}, kFov);
  scene.camera.up = {0, 0, -1};
  scene.textures.emplace_back(model);
  pt::RenderSettings settings = small_settings(kPixels, 1);
  settings.aovs = {pt::Aov::albedo};
  settings.texture_filter = filter;
  pt::Renderer renderer(scene, settings);
  renderer.render();

  const pt::AovImage picture = renderer.image();
  const std::vector<float>& albedo = picture.values(pt::Aov::albedo);
  double sum = 0, squares = 0;
  for (std::size_t i = 1; i < albedo.size(); i += 3) {
    sum += albedo[i];
    squares += static_cast<double>(albedo[i]) * albedo[i];
  }
  const double count = kPixels * kPixels, mean = sum / count;
  return {mean, std::sqrt(std::max(0.0, squares / count - mean * mean))};
}

void check_zoom(const std::string& model) {
  constexpr double kStep = 1.26;  // three steps per octave
  Statistics nearer = seen_at(model, 1, pt::TextureFilter::footprint);
  const Statistics first = nearer;
  for (double texels = kStep; texels < 48; texels *= kStep) {
    const Statistics now = seen_at(model, texels, pt::TextureFilter::footprint);
    CAPTURE(model, texels, nearer.mean, now.mean, nearer.deviation, now.deviation);
    // Contrast falls, in each step at most like that of white noise averaged over cubes, by
    // 1 / 1.26^1.5 = 0.71.
    CHECK(now.deviation < 1.1 * nearer.deviation + 0.002);
    CHECK(now.deviation > 0.47 * nearer.deviation - 0.002);
    CHECK(std::abs(now.mean - nearer.mean) < 0.35 * nearer.deviation + 0.003);
    nearer = now;
  }
  // Unfiltered points keep their full contrast: they flicker.
  const Statistics points = seen_at(model, 40, pt::TextureFilter::none);
  CHECK(points.deviation > 0.7 * first.deviation);
  CHECK(points.deviation > 8 * nearer.deviation);
}

}  // namespace

TEST_CASE("A zoom out of a solid texture neither flickers nor jumps") {
  const TemporaryFolder folder;
  write_noise_model(folder / "noise.solidtex", 0);
  check_zoom((folder / "noise.solidtex").string());
  check_zoom(SOLIDTEX_SOURCE "/models/stone-grey.solidtex");
}
