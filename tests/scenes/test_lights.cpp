// Direct light against formulas, and its estimators against each other.
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "catch.hpp"
#include "plugins/pathtracer/geometry/embree_scene.h"
#include "plugins/pathtracer/lights/environment.h"
#include "plugins/pathtracer/lights/lights.h"
#include "plugins/pathtracer/sampling/sample_sequence.h"
#include "plugins/pathtracer/sampling/sampling.h"
#include "tests/scenes/support.h"

using namespace scene_tests;

namespace {

// Form factor from a point to a parallel rectangle a x b at height h, one corner straight above.
double corner_form_factor(double a, double b, double h) {
  const double x = a / h, y = b / h;
  const double p = std::sqrt(1 + x * x), q = std::sqrt(1 + y * y);
  return (x / p * std::atan(y / p) + y / q * std::atan(x / q)) / glm::two_pi<double>();
}

pt::Scene plane_under_rectangle() {
  pt::Material material;
  material.color = glm::vec3(0.6f);
  pt::Scene scene = make_scene(make_quad(50), material, {4, 1.5f, 4}, 0.2f);
  // 2 x 1.2 at height 1, centered above the origin, facing down.
  scene.lights.push_back({{-1, 1, -0.6f}, {2, 0, 0}, {0, 0, 1.2f}, glm::vec3(3, 2, 1)});
  return scene;
}

pt::EmittedLight look_up(const pt::Environment& sky, const glm::vec3& direction) {
  pt::EmittedLight found;
  sky.evaluate({&direction, 1}, {&found, 1});
  return found;
}

// A dim environment with a few bright pixels.
pt::EnvironmentImage spotted_sky() {
  pt::EnvironmentImage sky{{"sky", 16, 8, std::vector<glm::vec3>(128, glm::vec3(0.1f))}, 30};
  sky.image.pixels[2 * 16 + 3] = glm::vec3(40, 20, 10);
  sky.image.pixels[4 * 16 + 12] = glm::vec3(2, 5, 9);
  sky.image.pixels[0] = glm::vec3(0);
  return sky;
}

// Lights of all kinds above the origin, most of them dim, and a dim environment.
std::vector<pt::Scene> lamps() {
  std::vector<pt::Scene> alone;
  for (int i = 0; i < 36; ++i) {
    pt::Scene& scene = alone.emplace_back();
    const auto x = static_cast<float>(i % 6 - 3), z = static_cast<float>(i / 6 - 3);
    const float brightness = i == 20 ? 300.0f : 1.0f;
    if (i % 3 == 0) {
      scene.sphere_lights.push_back({{x, 3, z}, 0.1f, glm::vec3(brightness)});
    } else if (i % 3 == 1) {
      scene.lights.push_back({{x, 3, z}, {0.3f, 0, 0}, {0, 0, 0.3f}, glm::vec3(brightness)});
    } else {
      pt::Mesh mesh = make_quad(0.15f);
      for (glm::vec3& p : mesh.positions) p += glm::vec3(x, 3, z);
      mesh.triangles = {{0, 2, 1}, {0, 3, 2}};  // facing down
      scene.mesh_lights.push_back({mesh, glm::vec3(brightness)});
    }
  }
  alone.emplace_back().environment = uniform_light({0.05f, 0.1f, 0.2f});
  return alone;
}

// Unoccluded irradiance at the origin: mean and variance of one sample.
struct Estimate {
  double mean = 0, variance = 0;
};
template <class Sample>
Estimate estimate_irradiance(const Sample& sample) {
  double sum = 0, squares = 0;
  constexpr std::uint32_t kSamples = 200000;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const pt::LightSample light = sample(pt::SampleSequence(7, 0, i));
    if (light.pdf <= 0) continue;
    const double value = light.radiance.y * std::max(light.direction.y, 0.0f) / light.pdf;
    sum += value;
    squares += value * value;
  }
  const double mean = sum / kSamples;
  return {mean, squares / kSamples - mean * mean};
}

glm::vec3 sphere_direction(float longitude, float polar) {
  return {std::sin(polar) * std::sin(longitude), std::cos(polar),
          std::sin(polar) * std::cos(longitude)};
}

pt::LightSample sample_one(const pt::Lights& lights, const glm::vec3& from, const glm::vec2& u) {
  pt::LightSample sample;
  lights.sample({&from, 1}, {&u, 1}, {&sample, 1});
  return sample;
}

}  // namespace

TEST_CASE("The irradiance of a parallel rectangle is its form factor") {
  const pt::Scene scene = plane_under_rectangle();
  const double expected = 0.6 * 4 * corner_form_factor(1, 0.6, 1);
  for (const auto strategy :
       {pt::LightSampling::mis, pt::LightSampling::lights, pt::LightSampling::bsdf}) {
    pt::RenderSettings settings = small_settings(16, 400);
    settings.light_sampling = strategy;
    const pt::Image image = pt::render(scene, settings);
    const glm::vec3 found = mean_color(image);
    CAPTURE(static_cast<int>(strategy), found.x / 3, expected);
    const bool passed = std::abs(found.x / 3 - expected) < 0.01 * expected &&
                        std::abs(found.y / 2 - expected) < 0.01 * expected &&
                        std::abs(found.z - expected) < 0.01 * expected;
    CHECK(save_unless(passed, image, "form-factor"));
  }
}

TEST_CASE("A rectangle emits on one side") {
  pt::Scene scene = plane_under_rectangle();
  std::swap(scene.lights[0].edge_u, scene.lights[0].edge_v);
  CHECK(mean_color(pt::render(scene, small_settings(8, 16))) == glm::vec3(0));
}

TEST_CASE("An object between light and plane casts a shadow") {
  pt::Scene scene = plane_under_rectangle();
  scene.meshes.push_back(make_cube());
  scene.objects.push_back({1, 0, glm::mat4(1)});
  // A flattened ball that hides the whole rectangle from the origin.
  scene.objects.back().to_world[1][1] = 0.01f;
  scene.objects.back().to_world[3] = {0, 0.9f, 0, 1};
  scene.objects.back().to_world[0][0] = scene.objects.back().to_world[2][2] = 1.1f;
  CHECK(mean_color(pt::render(scene, small_settings(8, 64))).x < 0.05f);
}

TEST_CASE("The irradiance of a sphere on a plane below is that of a point light") {
  for (const float radius : {0.01f, 0.9f}) {
    pt::Scene scene = plane_under_rectangle();
    scene.lights.clear();
    const float radiance = 2 / (radius * radius);
    scene.sphere_lights.push_back({{0, 1, 0}, radius, glm::vec3(radiance)});
    for (const auto strategy : {pt::LightSampling::mis, pt::LightSampling::lights}) {
      pt::RenderSettings settings = small_settings(16, 256);
      settings.light_sampling = strategy;
      settings.max_depth = 2;
      const float found = mean_color(pt::render(scene, settings)).x;
      CAPTURE(radius, found);
      CHECK(found == Approx(0.6f * 2).epsilon(0.01));  // albedo * radiance * (radius / height)^2
    }
  }
}

TEST_CASE("A mesh light equals the rectangle light of its shape") {
  pt::Scene scene = plane_under_rectangle();
  const pt::RectangleLight rectangle = scene.lights[0];
  scene.lights.clear();
  pt::Mesh mesh = make_quad(1);
  for (glm::vec3& p : mesh.positions) {
    const glm::vec2 t(p.x / 2 + 0.5f, p.z / 2 + 0.5f);
    p = rectangle.corner + t.x * rectangle.edge_u + t.y * rectangle.edge_v;
  }
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}};  // facing down
  scene.mesh_lights.push_back({mesh, rectangle.radiance});
  const double expected = 0.6 * 4 * corner_form_factor(1, 0.6, 1);
  for (const auto strategy :
       {pt::LightSampling::mis, pt::LightSampling::lights, pt::LightSampling::bsdf}) {
    pt::RenderSettings settings = small_settings(16, 400);
    settings.light_sampling = strategy;
    const float found = mean_color(pt::render(scene, settings)).x;
    CAPTURE(static_cast<int>(strategy), found / 3, expected);
    CHECK(found / 3 == Approx(expected).epsilon(0.01));
  }
  std::swap(scene.mesh_lights[0].mesh.triangles[0].x, scene.mesh_lights[0].mesh.triangles[0].y);
  std::swap(scene.mesh_lights[0].mesh.triangles[1].x, scene.mesh_lights[0].mesh.triangles[1].y);
  CHECK(mean_color(pt::render(scene, small_settings(8, 16))) == glm::vec3(0));  // its back
}

TEST_CASE("Light samples agree with the emission that rays hit") {
  pt::Scene scene;
  scene.lights.push_back({{-1, 4, -1}, {2, 0, 0}, {0, 0, 2}, glm::vec3(1)});
  scene.sphere_lights.push_back({{3, 0, 0}, 1.5f, glm::vec3(2)});
  pt::Mesh cube = make_cube();
  for (glm::vec3& p : cube.positions) p = 0.5f * p - glm::vec3(4, 1, 0);
  std::swap(cube.triangles[3], cube.triangles[8]);
  scene.mesh_lights.push_back({cube, glm::vec3(3)});
  const pt::Lights lights(scene);
  const pt::EmbreeScene geometry(scene);
  const glm::vec3 from(0.2f, 0.1f, -0.3f);
  int checked = 0;
  for (std::uint32_t i = 0; i < 3000; ++i) {
    const pt::SampleSequence sequence(5, 0, i);
    const pt::LightSample sample = sample_one(lights, from, sequence.get_2d(1));
    if (sample.pdf <= 0) continue;  // on the back of the cube
    const pt::Ray ray{.origin = from, .direction = sample.direction};
    const pt::Hit hit = geometry.intersect(ray);
    if (hit.kind != pt::Hit::Kind::light) continue;  // missed by rounding
    const pt::EmittedLight seen =
        lights.evaluate({hit.index, hit.triangle, ray.origin, ray.direction, hit.distance});
    CAPTURE(i, hit.index, hit.triangle);
    if (seen.pdf > 0 && seen.radiance == sample.radiance) {
      CHECK(seen.pdf == Approx(sample.pdf).epsilon(0.01));
      CHECK(std::abs(hit.distance - sample.distance) < 0.01f);
      CHECK(!geometry.occluded({ray.origin, ray.direction, sample.distance * 0.9999f}));
      ++checked;
    }
  }
  CHECK(checked > 2000);
}

TEST_CASE("Light selection by power reduces variance and is unbiased") {
  const std::vector<pt::Scene> alone = lamps();
  pt::Scene all;
  std::vector<pt::Lights> each;
  for (const pt::Scene& scene : alone) {
    each.emplace_back(scene);
    for (const auto& light : scene.lights) all.lights.push_back(light);
    for (const auto& light : scene.sphere_lights) all.sphere_lights.push_back(light);
    for (const auto& light : scene.mesh_lights) all.mesh_lights.push_back(light);
    if (scene.environment) all.environment = scene.environment;
  }
  const pt::Lights lights(all);
  const glm::vec3 origin(0);
  const Estimate found = estimate_irradiance([&](const pt::SampleSequence& sequence) {
    return sample_one(lights, origin, sequence.get_2d(1));
  });
  const auto count = static_cast<float>(each.size());
  const Estimate even = estimate_irradiance([&](const pt::SampleSequence& sequence) {
    const auto chosen = static_cast<std::size_t>(sequence.get_1d(0) * count);
    pt::LightSample light = sample_one(each[chosen], origin, sequence.get_2d(1));
    light.pdf /= count;
    return light;
  });
  CAPTURE(found.mean, found.variance, even.mean, even.variance);
  CHECK(found.mean == Approx(even.mean).epsilon(0.01));
  CHECK(found.variance < 0.1 * even.variance);
}

TEST_CASE("The environment's density integrates to one and matches its samples") {
  const pt::Environment sky(spotted_sky());
  double total = 0, power = 0;
  // Grid lines coincide with pixel borders, also after rotating by 30 degrees.
  constexpr int kColumns = 960, kRows = 800;
  for (int i = 0; i < kRows; ++i) {
    const float polar = glm::pi<float>() * (static_cast<float>(i) + 0.5f) / kRows;
    for (int j = 0; j < kColumns; ++j) {
      const glm::vec3 d =
          sphere_direction(glm::two_pi<float>() * (static_cast<float>(j) + 0.5f) / kColumns, polar);
      const pt::EmittedLight seen = look_up(sky, d);
      total += seen.pdf * std::sin(polar);
      power += seen.radiance.x * std::sin(polar);
    }
  }
  const double cell = 2 * glm::pi<double>() * glm::pi<double>() / (kColumns * kRows);
  CHECK(total * cell == Approx(1).epsilon(1e-4));

  double estimate = 0;
  int different = 0;
  constexpr std::size_t kSamples = 40000;
  std::vector<glm::vec2> numbers;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    numbers.push_back(pt::SampleSequence(1, 0, i).get_2d(0));
  }
  std::vector<pt::Environment::Sample> samples(kSamples);
  sky.sample(numbers, samples);
  for (std::size_t i = 0; i < kSamples; ++i) {
    const auto& [direction, found] = samples[i];
    REQUIRE(found.pdf > 0);
    REQUIRE(glm::length(direction) == Approx(1).margin(1e-5));
    // A sample at a pixel border may round into its neighbor.
    const pt::EmittedLight seen = look_up(sky, direction);
    if (std::abs(seen.pdf - found.pdf) > 1e-3f * found.pdf) ++different;
    CHECK(found.radiance.x == Approx(seen.radiance.x).margin(1e-3));
    estimate += found.radiance.x / found.pdf;
  }
  CHECK(different < 20);
  CHECK(estimate / kSamples == Approx(power * cell).epsilon(5e-3));
}

TEST_CASE("The center of an environment image is +z; rotation is about y") {
  pt::EnvironmentImage image{{"", 32, 16, std::vector<glm::vec3>(512, glm::vec3(0))}, 0};
  image.image.pixels[7 * 32 + 15] = image.image.pixels[7 * 32 + 16] = glm::vec3(1);
  image.image.pixels[8 * 32 + 15] = image.image.pixels[8 * 32 + 16] = glm::vec3(1);
  CHECK(look_up(pt::Environment(image), {0, 0, 1}).radiance.x == Approx(1));
  CHECK(look_up(pt::Environment(image), {0, 0, -1}).radiance.x == 0);
  image.rotation_degrees = 90;
  CHECK(look_up(pt::Environment(image), {1, 0, 0}).radiance.x == Approx(1));
  CHECK(look_up(pt::Environment(image), {0, 0, 1}).radiance.x == 0);
}

TEST_CASE("Light sampling, BSDF sampling and MIS agree") {
  pt::Material material;
  material.type = pt::MaterialType::coated;
  material.color = glm::vec3(0.5f, 0.4f, 0.3f);
  material.roughness = 0.4f;
  pt::Scene scene = make_scene(make_cube(), material, {3, 4, 5}, 30);
  scene.meshes.push_back(make_quad(6));
  scene.objects.push_back({1, 0, glm::mat4(1)});
  scene.objects.back().to_world[3] = {0, -1, 0, 1};
  scene.environment = spotted_sky();
  scene.lights.push_back({{-2, 3, -1}, {2, 0, 0}, {0, 0, 2}, glm::vec3(4)});
  scene.sphere_lights.push_back({{3, 1, 1}, 0.7f, glm::vec3(6)});
  pt::Mesh cube = make_cube();
  for (glm::vec3& p : cube.positions) p = 0.4f * p + glm::vec3(-2.5f, 0, 2);
  scene.mesh_lights.push_back({cube, glm::vec3(5)});

  const auto mean_and_error = [&](pt::LightSampling strategy) {
    double sum = 0, sum_of_squares = 0;
    constexpr int kRuns = 8;
    for (int run = 0; run < kRuns; ++run) {
      pt::RenderSettings settings = small_settings(24, 144);
      settings.light_sampling = strategy;
      settings.seed = static_cast<std::uint64_t>(run);
      const double mean = mean_color(pt::render(scene, settings)).x;
      sum += mean;
      sum_of_squares += mean * mean;
    }
    const double mean = sum / kRuns;
    return std::pair(mean, std::sqrt((sum_of_squares / kRuns - mean * mean) / (kRuns - 1)));
  };
  const auto [both, both_error] = mean_and_error(pt::LightSampling::mis);
  const auto [lights, lights_error] = mean_and_error(pt::LightSampling::lights);
  const auto [bsdf, bsdf_error] = mean_and_error(pt::LightSampling::bsdf);
  CAPTURE(both, both_error, lights, lights_error, bsdf, bsdf_error);
  CHECK(both_error < 0.005 * both);
  CHECK(bsdf_error < 0.03 * both);
  CHECK(std::abs(both - lights) < 5 * std::hypot(both_error, lights_error));
  CHECK(std::abs(both - bsdf) < 5 * std::hypot(both_error, bsdf_error));
}
