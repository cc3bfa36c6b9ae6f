// BSDFs of "diffuse" and "coated": densities, reciprocity, energy.
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "catch.hpp"
#include "plugins/pathtracer/materials/albedo_table.h"
#include "plugins/pathtracer/materials/material_bsdf.h"
#include "plugins/pathtracer/materials/microfacet.h"
#include "plugins/pathtracer/sampling/sample_sequence.h"
#include "plugins/pathtracer/sampling/sampling.h"
#include "tests/scenes/bsdf_checks.h"
#include "tests/scenes/directions.h"

using namespace solidtex::pathtracer;
using scene_tests::direction;
using scene_tests::integrate;

TEST_CASE("BSDF densities integrate to one, except for directions below the surface") {
  const Coat rough(0.4f, 1.5f);
  for (const Coat* coat : {static_cast<const Coat*>(nullptr), &rough}) {
    const CoatedBsdf bsdf{glm::vec3(0.5f), coat};
    const glm::vec3 out = direction(0.8f, 1.0f);
    const double total = integrate([&](const glm::vec3& in) { return double(bsdf.pdf(out, in)); });
    CAPTURE(coat != nullptr, total);
    CHECK(total > 0.99);
    CHECK(total < 1.001);
  }
}

TEST_CASE("BSDFs are reciprocal") {
  const Coat rough(0.3f, 1.5f);
  for (const Coat* coat : {static_cast<const Coat*>(nullptr), &rough}) {
    const CoatedBsdf bsdf{glm::vec3(0.2f, 0.5f, 0.9f), coat};
    CHECK(scene_tests::worst_reciprocity_error(bsdf) < 1e-4);
  }
}

TEST_CASE("BSDFs gain no energy, and white loses none") {
  for (const float roughness : {0.2f, 0.5f, 1.0f}) {
    const Coat coat(roughness, 1.5f);
    for (const float cosine : {0.15f, 0.5f, 1.0f}) {
      const glm::vec3 out = direction(cosine, 0);
      const CoatedBsdf white{glm::vec3(1), &coat}, gray{glm::vec3(0.5f), &coat};
      const double from_white =
          integrate([&](const glm::vec3& in) { return double(white.eval(out, in).x); });
      const double from_grey =
          integrate([&](const glm::vec3& in) { return double(gray.eval(out, in).x); });
      CAPTURE(roughness, cosine, from_white, from_grey);
      CHECK(from_white == Approx(1).margin(0.01));
      CHECK(from_grey < 0.75);
    }
  }
}

TEST_CASE("A coat interpolated from the table has nearly its own albedo") {
  Material material;
  material.type = MaterialType::coated;
  material.roughness = SolidChannel{0};
  const CoatTable coats(material);
  std::optional<Coat> scratch;
  for (const float roughness : {0.02f, 0.034f, 0.11f, 0.27f, 0.5f, 0.83f, 1.0f}) {
    const Coat exact(roughness, material.ior);
    const Coat& coat = *coats.at(roughness, scratch);
    CHECK(coat.alpha() == exact.alpha());
    CHECK(coat.average_albedo() == Approx(exact.average_albedo()).margin(5e-4));
    for (int i = 1; i <= 20; ++i) {
      const float cosine = static_cast<float>(i) / 20;
      CAPTURE(roughness, cosine);
      CHECK(coat.albedo(cosine) == Approx(exact.albedo(cosine)).margin(0.01));
    }
  }
  CHECK(coats.at(-3, scratch)->alpha() == Coat(kMinRoughness, 1.5f).alpha());
  CHECK(coats.at(7, scratch)->alpha() == 1);
}

TEST_CASE("Samples have the weight and density of the BSDF") {
  const Coat coat(0.25f, 1.6f);
  const CoatedBsdf bsdf{glm::vec3(0.3f, 0.6f, 0.9f), &coat};
  const glm::vec3 out = direction(0.4f, 0.5f);
  glm::dvec3 sum(0);
  constexpr int kSamples = 20000;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const SampleSequence sequence(7, 0, i);
    const BsdfSample s = bsdf.sample(out, sequence.get_1d(0), sequence.get_2d(1));
    if (s.pdf <= 0) continue;
    REQUIRE(glm::length(s.direction) == Approx(1).margin(1e-5));
    REQUIRE(s.pdf == Approx(bsdf.pdf(out, s.direction)));
    sum += glm::dvec3(s.weight);
  }
  for (int c = 0; c < 3; ++c) {
    const double exact =
        integrate([&](const glm::vec3& in) { return double(bsdf.eval(out, in)[c]); });
    CHECK(sum[c] / kSamples == Approx(exact).epsilon(0.01));
  }
}

TEST_CASE("Fresnel reflectance has its known values") {
  CHECK(fresnel_dielectric(1, 1.5f) == Approx(0.04f));
  CHECK(fresnel_dielectric(0, 1.5f) == Approx(1));
  const float brewster = std::cos(std::atan(1.5f));  // only s-polarized light is reflected
  const float s = (1 - 1.5f * 1.5f) / (1 + 1.5f * 1.5f);
  CHECK(fresnel_dielectric(brewster, 1.5f) == Approx(0.5f * s * s).epsilon(1e-4));
}
