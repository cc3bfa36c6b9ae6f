// Bump maps: height gradients against the texture's values, normals on the viewer's side.
#include <glm/gtc/matrix_transform.hpp>

#include "catch.hpp"
#include "plugins/pathtracer/materials/material_sample.h"
#include "plugins/pathtracer/sampling/sampling.h"
#include "tests/scenes/directions.h"
#include "tests/scenes/support.h"

using namespace scene_tests;

namespace {

constexpr float kDepth = 0.03f;

// Noise of single texels with one channel, the height.
pt::Scene bumpy_scene(const TemporaryFolder& folder, bool world_space, const glm::mat4& to_world) {
  write_noise_model(folder / "height.solidtex", 0, {"height"});
  pt::Scene scene;
  scene.textures.emplace_back((folder / "height.solidtex").string());
  pt::Material material;
  material.channels_of =
      pt::SolidColor{0, world_space, glm::scale(glm::dmat4(1), glm::dvec3(20, 10, 40))};
  material.bump = pt::Bump{0, kDepth};
  scene.materials.push_back(material);
  scene.meshes.push_back(make_quad(1));
  scene.objects.push_back({0, 0, to_world});
  return scene;
}

glm::vec2 slope_at(const pt::Scene& scene, const pt::SurfaceInteraction& interaction) {
  pt::MaterialEvaluator lookup(scene, pt::TextureFilter::footprint);
  std::array<pt::MaterialSample, 1> found;
  CHECK(lookup(std::array{interaction}, found) == 5);
  return found[0].height_gradient;
}

float height(const pt::Scene& scene, const glm::vec3& texels) {
  const std::array<float, 3> point = {texels.x, texels.y, texels.z};
  std::array<float, 1> value;
  scene.textures[0].eval_points({0, 0, 0}, point, value);
  return value[0];
}

}  // namespace

TEST_CASE("A bump's height gradient is that of the texture along the surface") {
  const TemporaryFolder folder;
  glm::mat4 turned = glm::rotate(glm::mat4(1), 0.8f, glm::normalize(glm::vec3(1, 2, -1)));
  turned = glm::scale(turned, glm::vec3(1.5f, 0.5f, 2));
  for (const bool world_space : {false, true}) {
    const pt::Scene scene = bumpy_scene(folder, world_space, turned);
    Random random(4);
    for (int i = 0; i < 50; ++i) {
      pt::SurfaceInteraction interaction;
      interaction.object_position = {random.next(), random.next(), random.next()};
      interaction.position = glm::vec3(turned * glm::vec4(interaction.object_position, 1));
      interaction.normal = direction(2 * random.next() - 1, 6 * random.next());
      const glm::vec2 height_gradient = slope_at(scene, interaction);
      // A step of half a texel along the surface, in texels.
      const pt::Frame frame(interaction.normal);
      for (int axis = 0; axis < 2; ++axis) {
        const glm::vec3 along = axis == 0 ? frame.x : frame.y;
        const glm::vec3 scale(20, 10, 40);
        const glm::vec3 here =
            scale * (world_space ? interaction.position : interaction.object_position);
        const glm::vec3 texels =
            scale * (world_space ? along : glm::inverse(glm::mat3(turned)) * along);
        const float step = 0.5f / glm::length(texels);
        const float rise =
            height(scene, here + step * texels) - height(scene, here - step * texels);
        CAPTURE(world_space, i, axis);
        CHECK(height_gradient[axis] == Approx(kDepth * rise / (2 * step)).margin(2e-4));
      }
    }
  }
}

TEST_CASE("Between two voxels a bump's height gradient is their difference per texel") {
  const TemporaryFolder folder;
  const pt::Scene scene = bumpy_scene(folder, false, glm::mat4(1));
  std::array<float, 2> voxels;
  scene.textures[0].eval_box({6, 3, 9}, {2, 1, 1}, voxels);
  pt::SurfaceInteraction interaction;  // halfway between both centers
  interaction.object_position = glm::vec3(7, 3.5f, 9.5f) / glm::vec3(20, 10, 40);
  interaction.normal = {0, 0, 1};
  const pt::Frame frame(interaction.normal);
  const glm::vec2 height_gradient = slope_at(scene, interaction);
  const glm::vec3 gradient = height_gradient.x * frame.x + height_gradient.y * frame.y;
  CHECK(gradient.x == Approx(kDepth * 20 * (voxels[1] - voxels[0])).margin(1e-4));
}

TEST_CASE("A bump tilts the normal against the height gradient, never away from the viewer") {
  const glm::vec3 normal = direction(0.3f, 1);
  const pt::Frame frame(normal);
  const glm::vec3 bumped = pt::bumped_normal(normal, {0.5f, -0.25f}, normal);
  CHECK(glm::dot(bumped, frame.x) / glm::dot(bumped, normal) == Approx(-0.5f));
  CHECK(glm::dot(bumped, frame.y) / glm::dot(bumped, normal) == Approx(0.25f));
  CHECK(pt::bumped_normal(normal, {0, 0}, normal) == normal);
  Random random(9);
  for (int i = 0; i < 2000; ++i) {
    const glm::vec3 view =
        frame.to_world(direction(0.001f + 0.999f * random.next(), 6.3f * random.next()));
    const glm::vec2 height_gradient(20 * random.next() - 10, 20 * random.next() - 10);
    const glm::vec3 n = pt::bumped_normal(normal, height_gradient, view);
    REQUIRE(glm::length(n) == Approx(1).margin(1e-5));
    REQUIRE(glm::dot(n, view) > 0.005f);
  }
}

TEST_CASE("A bumpy ball in a furnace gains no energy and loses little") {
  const TemporaryFolder folder;
  pt::Scene scene = make_scene(make_sphere(24), {}, {0, 0, 4}, 15);
  scene.materials[0].color = glm::vec3(1);
  scene.environment = uniform_light(glm::vec3(1));
  write_noise_model(folder / "height.solidtex", 0, {"height"});
  scene.textures.emplace_back((folder / "height.solidtex").string());
  scene.materials[0].channels_of =
      pt::SolidColor{0, false, glm::scale(glm::dmat4(1), glm::dvec3(8))};
  pt::RenderStatistics flat_work, work;
  const pt::Image image = pt::render(scene, small_settings(16, 64), {}, &flat_work);
  CHECK(mean_color(image).x == Approx(1).margin(0.01));
  scene.materials[0].bump = pt::Bump{0, 0.05f};
  const float found = mean_color(pt::render(scene, small_settings(16, 64), {}, &work)).x;
  CAPTURE(found);
  CHECK(found < 1.005f);
  CHECK(found > 0.85f);
  CHECK(flat_work.texture_point_count == 0);  // its texture is not evaluated
  CHECK(work.texture_point_count > 0);
}
