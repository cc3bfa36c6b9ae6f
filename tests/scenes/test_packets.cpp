// Ray packets: each ray gives the bits of a single query, so that images do not depend on how rays
// are grouped.
#include <bit>
#include <glm/gtc/matrix_transform.hpp>

#include "catch.hpp"
#include "plugins/pathtracer/geometry/embree_scene.h"
#include "plugins/pathtracer/sampling/sample_sequence.h"
#include "plugins/pathtracer/sampling/sampling.h"
#include "tests/scenes/support.h"

using namespace scene_tests;

namespace {

// Two rotated balls and lights.
pt::Scene crowd(bool with_sphere_light) {
  pt::Scene scene = make_scene(make_sphere(40), {}, {0, 1, 6}, 35);
  scene.objects[0].to_world =
      glm::rotate(glm::translate(glm::mat4(1), glm::vec3(-1.1f, 0, 0)), 0.7f, {1, 2, 3});
  scene.objects.push_back(
      {0, 0, glm::scale(glm::translate(glm::mat4(1), {1.1f, 0.1f, 0}), glm::vec3(1, 1.2f, 0.7f))});
  scene.lights.push_back({{-1, 3, -1}, {2, 0, 0}, {0, 0, 2}, glm::vec3(4)});
  if (with_sphere_light) scene.sphere_lights.push_back({{0, -1.5f, 1}, 0.4f, glm::vec3(2)});
  pt::Mesh cube = make_cube();
  for (glm::vec3& p : cube.positions) p = 0.5f * p + glm::vec3(0, 2, -2);
  scene.mesh_lights.push_back({cube, glm::vec3(3)});
  return scene;
}

glm::vec3 point_in_cube(const pt::SampleSequence& sequence, std::uint32_t dimension) {
  return 4.0f * glm::vec3(sequence.get_2d(dimension), sequence.get_1d(dimension + 1)) - 2.0f;
}

// A coherent bundle from one point, or incoherent rays.
std::vector<pt::Ray> make_rays(bool alike, std::uint32_t group, std::uint32_t count) {
  std::vector<pt::Ray> rays;
  const pt::SampleSequence first(3, group, 0);
  for (std::uint32_t i = 0; i < count; ++i) {
    const pt::SampleSequence own(3, group, i);
    const glm::vec3 origin = alike ? 3.0f * point_in_cube(first, 0) : point_in_cube(own, 0);
    const glm::vec3 target =
        alike ? point_in_cube(first, 2) + 0.02f * point_in_cube(own, 4) : point_in_cube(own, 2);
    rays.push_back({.origin = origin, .direction = glm::normalize(target - origin)});
  }
  return rays;
}

bool same_bits(float a, float b) {
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

bool same_bits(const pt::Hit& a, const pt::Hit& b) {
  return a.kind == b.kind && a.index == b.index && a.triangle == b.triangle &&
         same_bits(a.distance, b.distance) && same_bits(a.barycentric.x, b.barycentric.x) &&
         same_bits(a.barycentric.y, b.barycentric.y);
}

}  // namespace

TEST_CASE("A ray hits the same in a packet as alone") {
  const pt::Scene scene = crowd(GENERATE(false, true));
  const pt::EmbreeScene geometry(scene);
  int objects = 0, lights = 0;
  for (const bool alike : {true, false}) {
    for (std::uint32_t group = 0; group < 400; ++group) {
      const std::vector<pt::Ray> rays = make_rays(alike, group, 1 + group % 37);
      std::vector<pt::Hit> hits(rays.size());
      geometry.intersect(rays, alike, hits);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        CAPTURE(alike, group, i);
        REQUIRE(same_bits(hits[i], geometry.intersect(rays[i])));
        objects += hits[i].kind == pt::Hit::Kind::object;
        lights += hits[i].kind == pt::Hit::Kind::light;
      }
    }
  }
  CHECK(objects > 3000);
  CHECK(lights > 300);
}

TEST_CASE("A shadow ray has the same occlusion in a packet as alone") {
  const pt::Scene scene = crowd(GENERATE(false, true));
  const pt::EmbreeScene geometry(scene);
  int shadowed = 0, all = 0;
  for (const bool alike : {true, false}) {
    for (std::uint32_t group = 0; group < 400; ++group) {
      std::vector<pt::ShadowRay> rays;
      for (const pt::Ray& ray : make_rays(alike, group, 1 + group % 37)) {
        rays.push_back({ray.origin, ray.direction, 2.0f + static_cast<float>(group % 5)});
      }
      std::vector<std::uint8_t> results(rays.size());
      geometry.occluded(rays, results);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        CAPTURE(alike, group, i);
        REQUIRE((results[i] != 0) == geometry.occluded(rays[i]));
        shadowed += results[i];
        ++all;
      }
    }
  }
  CHECK(shadowed > all / 10);
  CHECK(shadowed < all * 9 / 10);
}
