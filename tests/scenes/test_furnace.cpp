// Energy conservation in scenes with known radiance.
#include "catch.hpp"
#include "tests/scenes/support.h"

using namespace scene_tests;

namespace {

pt::Material diffuse(float albedo) {
  pt::Material material;
  material.color = glm::vec3(albedo);
  return material;
}

pt::Material coated(float albedo, float roughness) {
  pt::Material material = diffuse(albedo);
  material.type = pt::MaterialType::coated;
  material.roughness = roughness;
  return material;
}

// Mean radiance of a convex object that fills the image, in an environment of radiance 1.
pt::Image render_in_furnace(const pt::Material& material, int samples) {
  pt::Scene scene = make_scene(make_sphere(24), material, {0, 0, 4}, 15);
  scene.environment = uniform_light(glm::vec3(1));
  return pt::render(scene, small_settings(24, samples));
}

}  // namespace

TEST_CASE("A diffuse ball in a furnace reflects its albedo") {
  for (const float albedo : {1.0f, 0.5f, 0.0f}) {
    const pt::Image image = render_in_furnace(diffuse(albedo), 256);
    const float found = mean_color(image).x;
    CAPTURE(albedo, found);
    CHECK(save_unless(std::abs(found - albedo) < 0.003f, image, "furnace-diffuse"));
  }
}

TEST_CASE("A coated white ball in a furnace conserves energy") {
  for (const float roughness : {0.05f, 0.3f, 1.0f}) {
    const pt::Image image = render_in_furnace(coated(1, roughness), 256);
    const float found = mean_color(image).x;
    CAPTURE(roughness, found);
    CHECK(save_unless(std::abs(found - 1) < 0.005f, image, "furnace-coated"));
  }
}

TEST_CASE("A coat reflects a little over black, and less over gray than over white") {
  const float black = mean_color(render_in_furnace(coated(0, 0.2f), 128)).x;
  const float gray = mean_color(render_in_furnace(coated(0.5f, 0.2f), 128)).x;
  CAPTURE(black, gray);
  CHECK(black > 0.03f);  // 4 % at normal incidence for an index of 1.5, more at the rim
  CHECK(black < 0.12f);
  CHECK(gray > black + 0.2f);
  CHECK(gray < 0.55f);
}

TEST_CASE("A glowing closed sphere has radiance E / (1 - a) inside") {
  for (const float albedo : {0.0f, 0.5f, 0.8f}) {
    pt::Material material = diffuse(albedo);
    material.emission = glm::vec3(1, 0.5f, 0.25f);
    const pt::Scene scene = make_scene(make_sphere(24), material, {0, 0, 0.3f}, 60);
    pt::RenderSettings settings = small_settings(24, 400);
    settings.max_depth = 200;
    const pt::Image image = pt::render(scene, settings);
    const glm::vec3 found = mean_color(image) * (1 - albedo) / material.emission;
    CAPTURE(albedo, found.x, found.y, found.z);
    CHECK(save_unless(glm::all(glm::lessThan(glm::abs(found - 1.0f), glm::vec3(0.01f))), image,
                      "glowing-sphere"));
  }
}

TEST_CASE("max_depth 1 gives emission only; paths have at most max_depth segments") {
  pt::Material material = diffuse(0.5f);
  material.emission = glm::vec3(1);
  const pt::Scene scene = make_scene(make_sphere(24), material, {0, 0, 0.3f}, 60);
  pt::RenderSettings settings = small_settings(8, 64);
  float expected = 0;
  for (int depth = 1; depth <= 4; ++depth) {
    settings.max_depth = depth;
    expected += std::pow(0.5f, static_cast<float>(depth - 1));
    CHECK(mean_color(pt::render(scene, settings)).x == Approx(expected).epsilon(1e-4));
  }
}
