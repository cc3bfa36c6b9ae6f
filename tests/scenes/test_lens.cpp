// Depth of field: focus and circle of confusion of a thin lens.
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "catch.hpp"
#include "plugins/pathtracer/integrator/camera.h"
#include "tests/scenes/support.h"

using namespace scene_tests;

namespace {

// A small emitter, 8 units in front of the camera.
pt::Scene glowing_point(float aperture, float focus_distance) {
  pt::Material glow;
  glow.color = glm::vec3(0);
  glow.emission = glm::vec3(1);
  pt::Scene scene = make_scene(make_quad(0.05f), glow, {0, 8, 0}, 20);
  scene.camera.up = {0, 0, -1};
  scene.camera.aperture = aperture;
  scene.camera.focus_distance = focus_distance;
  return scene;
}

struct Spot {
  double light = 0;          // sum over pixels
  double square_radius = 0;  // mean squared distance to the centroid, in pixels
};
Spot spot_of(const pt::Scene& scene) {
  const pt::Image image = pt::render(scene, small_settings(64, 1024));
  Spot spot;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const double light = image.rgb[static_cast<std::size_t>(y * 64 + x) * 3];
      const double dx = x - 31.5, dy = y - 31.5;
      spot.light += light;
      spot.square_radius += light * (dx * dx + dy * dy);
    }
  }
  spot.square_radius /= spot.light;
  return spot;
}

}  // namespace

TEST_CASE("A point in focus is as sharp as with a pinhole camera") {
  const Spot pinhole = spot_of(glowing_point(0, 0)), lens = spot_of(glowing_point(0.5f, 8));
  const Spot looked_at = spot_of(glowing_point(0.5f, 0));
  CAPTURE(pinhole.square_radius, lens.square_radius);
  CHECK(lens.square_radius == Approx(pinhole.square_radius).epsilon(0.02));
  CHECK(lens.light == Approx(pinhole.light).epsilon(0.02));
  CHECK(looked_at.square_radius == Approx(lens.square_radius).epsilon(1e-6));
}

TEST_CASE("A point out of focus fills its circle of confusion") {
  const Spot sharp = spot_of(glowing_point(0, 0));
  for (const double focus : {5.0, 16.0}) {
    const double aperture = 0.3, distance = 8;
    const Spot spot = spot_of(glowing_point(0.3f, static_cast<float>(focus)));
    const double pixel = 2 * std::tan(glm::radians(10.0)) / 64;  // pixel width at distance 1
    const double radius = aperture * std::abs(1 / distance - 1 / focus) / pixel;
    const double found = spot.square_radius - sharp.square_radius;
    CAPTURE(focus, radius, found);
    CHECK(radius > 3);
    CHECK(found == Approx(radius * radius / 2).epsilon(0.03));  // of a uniform disc
    CHECK(spot.light == Approx(sharp.light).epsilon(0.03));
  }
}

TEST_CASE("The cone of a lens ray is narrowest at the focus") {
  pt::Camera camera;
  camera.position = {0, 0, 5};
  camera.aperture = 0.4f;
  const pt::CameraRays lens(camera, 100, 100, 4);
  camera.aperture = 0;
  const pt::CameraRays pinhole(camera, 100, 100, 4);
  const pt::Ray ray = lens.ray(50, 50, {0.3f, 0.6f}), straight = pinhole.ray(50, 50, {0.3f, 0.6f});
  const float focus = 1 / ray.inverse_focus;
  CHECK(glm::length(ray.origin + focus * ray.direction) < 1e-5f);  // the look-at point
  CHECK(ray.radius_at(0) == Approx(0.4f / 2));                     // divided among four samples
  CHECK(ray.radius_at(focus) == Approx(straight.radius_at(focus)));
  CHECK(ray.radius_at(2 * focus) == Approx(0.4f / 2 + straight.radius_at(2 * focus)));
  CHECK(straight.radius_at(0) == 0);
}
