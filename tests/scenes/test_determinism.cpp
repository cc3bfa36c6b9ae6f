// Bits do not depend on the number of threads; instances equal transformed meshes.
#include <atomic>
#include <cstring>
#include <glm/gtc/matrix_transform.hpp>

#include "catch.hpp"
#include "tests/scenes/support.h"

using namespace scene_tests;

namespace {

bool same_bits(const pt::Image& a, const pt::Image& b) {
  return a.rgb.size() == b.rgb.size() &&
         std::memcmp(a.rgb.data(), b.rgb.data(), a.rgb.size() * sizeof(float)) == 0;
}

// Number of values that differ by more than rounding.
std::size_t count_different(const pt::Image& a, const pt::Image& b) {
  std::size_t different = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) {
    if (std::abs(a.rgb[i] - b.rgb[i]) > 1e-3f) ++different;
  }
  return different;
}

// Two balls with a solid texture between colored lights.
pt::Scene textured_scene(const TemporaryFolder& folder) {
  write_noise_model(folder / "noise.solidtex", 3);
  pt::Material material;
  material.type = pt::MaterialType::coated;
  material.color = pt::SolidColor{0, false, glm::scale(glm::dmat4(1), glm::dvec3(20))};
  pt::Scene scene = make_scene(make_sphere(16), material, {0, 1, 6}, 35);
  scene.objects[0].to_world = glm::translate(glm::mat4(1), glm::vec3(-1.1f, 0, 0));
  scene.objects.push_back({0, 0, glm::translate(glm::mat4(1), glm::vec3(1.1f, 0, 0))});
  scene.textures.emplace_back((folder / "noise.solidtex").string());
  scene.environment = uniform_light({0.2f, 0.3f, 0.4f});
  scene.lights.push_back({{-1, 3, -1}, {2, 0, 0}, {0, 0, 2}, glm::vec3(4)});
  return scene;
}

// With normals that point away from the center.
pt::Scene lit_cube() {
  pt::Scene scene = make_scene(make_cube(), {}, {2, 3, 4}, 40);
  scene.meshes[0].normals = scene.meshes[0].positions;
  scene.environment = uniform_light({1, 0.5f, 0.2f});
  scene.lights.push_back({{-1, 3, -1}, {2, 0, 0}, {0, 0, 2}, glm::vec3(4)});
  return scene;
}

}  // namespace

TEST_CASE("The bits of an image are equal with 1, 2 and 4 threads") {
  const TemporaryFolder folder;
  const pt::Scene scene = textured_scene(folder);
  pt::RenderSettings settings = small_settings(80, 9);  // several tiles, an odd sample count
  settings.height = 50;
  settings.threads = 1;
  const pt::Image one = pt::render(scene, settings);
  for (const int threads : {2, 4}) {
    settings.threads = threads;
    CHECK(save_unless(same_bits(one, pt::render(scene, settings)), one, "threads"));
  }
  settings.seed = 1;
  CHECK(!same_bits(one, pt::render(scene, settings)));
}

TEST_CASE("An instance equals a transformed mesh") {
  glm::mat4 transform = glm::translate(glm::mat4(1), glm::vec3(0.3f, -0.2f, 0.1f));
  transform = glm::rotate(transform, 0.7f, glm::normalize(glm::vec3(1, 2, 3)));
  transform = glm::scale(transform, glm::vec3(1.2f, 0.5f, -0.8f));  // also mirrors it

  pt::Scene instanced = lit_cube(), baked = lit_cube();
  instanced.objects[0].to_world = transform;
  // A mesh is instanced if it has several objects: adds one out of sight.
  instanced.objects.push_back({0, 0, glm::translate(glm::mat4(1), glm::vec3(0, 0, 1e6f))});
  const glm::mat3 normal_matrix = glm::transpose(glm::inverse(glm::mat3(transform)));
  for (auto& p : baked.meshes[0].positions) p = glm::vec3(transform * glm::vec4(p, 1));
  for (auto& n : baked.meshes[0].normals) n = normal_matrix * n;

  const pt::Image a = pt::render(instanced, small_settings(48, 16));
  const pt::Image b = pt::render(baked, small_settings(48, 16));
  // Rounding moves a few paths across an edge; all others are equal.
  const std::size_t different = count_different(a, b);
  CAPTURE(different, a.rgb.size());
  CHECK(mean_color(a).x > 0.3f);
  CHECK(save_unless(different < a.rgb.size() / 100, a, "instance"));
}

TEST_CASE("An object is equal with a shared and an unshared mesh") {
  pt::Scene alone = lit_cube(), shared = lit_cube();
  shared.objects.push_back({0, 0, glm::translate(glm::mat4(1), glm::vec3(0, 0, 1e6f))});
  const pt::Image a = pt::render(alone, small_settings(48, 16));
  const pt::Image b = pt::render(shared, small_settings(48, 16));
  const std::size_t different = count_different(a, b);
  CAPTURE(different, a.rgb.size());
  CHECK(save_unless(different < a.rgb.size() / 100, a, "shared"));
}

TEST_CASE("should_stop stops a render") {
  const TemporaryFolder folder;
  const pt::Scene scene = textured_scene(folder);
  CHECK_THROWS_AS(pt::render(scene, small_settings(64, 16), {{}, [] { return true; }}),
                  pt::RenderStopped);
}

TEST_CASE("Reported progress adds up to all samples") {
  const TemporaryFolder folder;
  std::atomic<std::uint64_t> count = 0;
  pt::render(textured_scene(folder), small_settings(40, 5),
             {[&](std::uint64_t n) { count += n; }, {}});
  CHECK(count == 40 * 40 * 5);
}
