// BSDF of "dielectric", and scenes with known radiance.
#include <glm/gtc/matrix_transform.hpp>

#include "catch.hpp"
#include "plugins/pathtracer/materials/bsdf.h"
#include "plugins/pathtracer/materials/microfacet.h"
#include "tests/scenes/bsdf_checks.h"
#include "tests/scenes/support.h"

using namespace scene_tests;

namespace {

constexpr float kIor = 1.5f;

const pt::DielectricBsdf::Tables& tables() {
  static const pt::DielectricBsdf::Tables tables(kIor);
  return tables;
}

pt::Bsdf make(float roughness, bool inside) {
  return pt::Bsdf(pt::DielectricBsdf(glm::vec3(1), roughness, inside, tables()));
}

pt::Material glass(float roughness) {
  pt::Material material;
  material.type = pt::MaterialType::dielectric;
  material.color = glm::vec3(1);
  material.roughness = roughness;
  return material;
}

}  // namespace

TEST_CASE("Dielectric: samples have the density and the weight of the BSDF") {
  for (const bool inside : {false, true}) {
    for (const float roughness : {0.5f, 1.0f}) {
      for (const float cosine : {0.3f, 0.9f}) {
        const pt::Bsdf bsdf = make(roughness, inside);
        const glm::vec3 out = direction(cosine, 0.7f);
        const SampleCheck check = check_samples(bsdf, out);
        const double exact =
            integrate([&](const glm::vec3& in) { return double(bsdf.eval(out, in).x); }, -1, 1);
        CAPTURE(inside, roughness, cosine, check.surplus, check.mean_weight.x, exact);
        CHECK(check.surplus < 5);
        CHECK(check.worst_pdf_error < 1e-3);
        CHECK(check.mean_weight.x == Approx(exact).epsilon(0.015));
      }
    }
  }
}

TEST_CASE("Dielectric: energy is conserved on both sides") {
  for (const bool inside : {false, true}) {
    const double squeeze = inside ? 1 / (kIor * kIor) : kIor * kIor;
    for (const float roughness : {0.3f, 0.6f, 1.0f}) {
      for (const float cosine : {0.2f, 0.6f, 1.0f}) {
        const pt::Bsdf bsdf = make(roughness, inside);
        const glm::vec3 out = direction(cosine, 0);
        const auto light = [&](const glm::vec3& in) { return double(bsdf.eval(out, in).x); };
        const double back = integrate(light), through = integrate(light, -1, 0) * squeeze;
        CAPTURE(inside, roughness, cosine, back, through);
        CHECK(back + through == Approx(1).margin(0.01));
      }
    }
  }
}

TEST_CASE("Dielectric: reciprocal up to the square of the index") {
  for (const float roughness : {0.3f, 0.8f}) {
    const pt::Bsdf outer = make(roughness, false), inner = make(roughness, true);
    for (int i = 1; i < 10; ++i) {
      for (int j = 1; j < 10; ++j) {
        const glm::vec3 a = direction(0.1f * static_cast<float>(i), 0.3f);
        const glm::vec3 b = direction(-0.1f * static_cast<float>(j) + 0.03f, 2.9f);
        const glm::vec3 below(b.x, b.y, -b.z), above(a.x, a.y, -a.z);  // seen from inside
        const float there = outer.eval(a, b).x / below.z, back = inner.eval(below, above).x / a.z;
        CAPTURE(roughness, i, j);
        CHECK(there * kIor * kIor == Approx(back).epsilon(2e-3).margin(1e-6));
      }
    }
  }
}

TEST_CASE("Smooth dielectric: Snell's law and Fresnel's equations") {
  for (const bool inside : {false, true}) {
    const pt::Bsdf bsdf = make(0, inside);
    const float ior = inside ? 1 / kIor : kIor;
    for (const float cosine : {0.8f, 0.95f}) {
      const glm::vec3 out = direction(cosine, 0);
      Random random(3);
      double through = 0;
      int far_off = 0;  // GGX has long tails
      constexpr int kSamples = 4000;
      for (int i = 0; i < kSamples; ++i) {
        const float lobe = random.next(), u = random.next(), v = random.next();
        const pt::BsdfSample sample = bsdf.sample(out, lobe, {u, v});
        if (sample.direction.z >= 0) continue;
        through += 1.0 / kSamples;
        CHECK(sample.ior == ior);
        if (std::abs(sample.direction.x + out.x / ior) > 0.01f) ++far_off;
        CHECK(sample.weight.x == Approx(1 / (ior * ior)).epsilon(0.01));
      }
      CHECK(far_off < kSamples / 100);
      CHECK(1 - through == Approx(pt::fresnel_dielectric(cosine, ior)).margin(0.02));
    }
  }
}

TEST_CASE("Dielectric: total internal reflection beyond the critical angle") {
  const pt::Bsdf bsdf = make(0, true);
  const glm::vec3 out = direction(0.6f, 0);  // the sine is 0.8, the limit 1 / 1.5
  Random random(3);
  for (int i = 0; i < 1000; ++i) {
    const float lobe = random.next(), u = random.next(), v = random.next();
    const pt::BsdfSample sample = bsdf.sample(out, lobe, {u, v});
    if (sample.alpha < 0) continue;  // a diffuse sample, one in millions
    CHECK(sample.direction.z > 0);
    CHECK(sample.weight.x == Approx(1).epsilon(0.01));
  }
}

TEST_CASE("A glass ball in a furnace is invisible") {
  for (const float roughness : {0.0f, 0.4f, 1.0f}) {
    pt::Scene scene = make_scene(make_sphere(24), glass(roughness), {0, 0, 4}, 15);
    scene.environment = uniform_light(glm::vec3(1));
    pt::RenderSettings settings = small_settings(16, 128);
    settings.max_depth = 200;
    const pt::Image image = pt::render(scene, settings);
    const float found = mean_color(image).x;
    CAPTURE(roughness, found);
    CHECK(save_unless(std::abs(found - 1) < 0.01f, image, "furnace-glass"));
  }
}

TEST_CASE("A pane of glass shifts by Snell's law and attenuates by Fresnel's equations") {
  // The camera looks down at 45 degrees to the origin, through a pane one unit thick.
  pt::Scene scene = make_scene(make_cube(), glass(0), {-6, 6, 0}, 0.3f);
  scene.objects[0].to_world = glm::translate(glm::mat4(1), glm::vec3(0, 1.5f, 0)) *
                              glm::scale(glm::mat4(1), glm::vec3(20, 0.5f, 20));
  // A small emitter where the refracted view ray must hit.
  const float sine = std::sqrt(0.5f) / kIor;
  const float shift = 1 - sine / std::sqrt(1 - sine * sine);
  pt::Material glow;
  glow.color = glm::vec3(0);
  glow.emission = glm::vec3(1);
  scene.materials.push_back(glow);
  scene.meshes.push_back(make_quad(0.1f));
  scene.objects.push_back({1, 1, glm::translate(glm::mat4(1), glm::vec3(-shift, 0, 0))});
  const pt::Image image = pt::render(scene, small_settings(16, 256));
  const float once = 1 - pt::fresnel_dielectric(std::sqrt(0.5f), kIor);
  const float found = mean_color(image).x;
  CAPTURE(found, once * once);
  CHECK(save_unless(std::abs(found - once * once) < 0.01f, image, "pane"));
}

TEST_CASE("Rough glass: light sampling, BSDF sampling and MIS agree") {
  pt::Scene scene = make_scene(make_sphere(12), glass(0.5f), {0, 1, 4}, 35);
  scene.lights.push_back({{-1, -1, -3}, {2, 0, 0}, {0, 2, 0}, glm::vec3(4)});  // behind it
  const auto mean = [&](pt::LightSampling strategy) {
    pt::RenderSettings settings = small_settings(24, 576);
    settings.light_sampling = strategy;
    return mean_color(pt::render(scene, settings)).x;
  };
  const float both = mean(pt::LightSampling::mis);
  CAPTURE(both);
  CHECK(both > 0.05f);
  CHECK(mean(pt::LightSampling::lights) == Approx(both).epsilon(0.04));
  CHECK(mean(pt::LightSampling::bsdf) == Approx(both).epsilon(0.04));
}
