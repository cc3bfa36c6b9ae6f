// BSDF of "principled", textured inputs, furnace test.
#include "catch.hpp"
#include "plugins/pathtracer/materials/bsdf.h"
#include "plugins/pathtracer/materials/material_sample.h"
#include "tests/scenes/bsdf_checks.h"
#include "tests/scenes/support.h"

using namespace scene_tests;

namespace {

using Parameters = pt::PrincipledBsdf::Parameters;

const pt::PrincipledBsdf::Tables& tables() {
  static const pt::PrincipledBsdf::Tables tables(1.5f);
  return tables;
}

pt::Bsdf make(const Parameters& parameters) {
  return pt::Bsdf(pt::PrincipledBsdf(parameters, tables()));
}

const std::vector<Parameters>& examples() {
  const glm::vec3 color(0.8f, 0.5f, 0.2f);
  static const std::vector<Parameters> list = {
      {.color = color, .roughness = 0.6f},
      {.color = color, .roughness = 0.5f, .metallic = 1},
      {.color = color, .roughness = 0.8f, .metallic = 0.4f, .specular = 0.6f},
      {.color = color, .roughness = 0.7f, .metallic = 0.3f, .coat = 0.8f, .coat_roughness = 0.5f}};
  return list;
}

double reflected(const pt::Bsdf& bsdf, const glm::vec3& out) {
  return integrate([&](const glm::vec3& in) { return double(bsdf.eval(out, in).x); });
}

}  // namespace

TEST_CASE("Principled: samples have the density and the weight of the BSDF") {
  for (std::size_t i = 0; i < examples().size(); ++i) {
    const pt::Bsdf bsdf = make(examples()[i]);
    for (const float cosine : {0.25f, 0.9f}) {
      const glm::vec3 out = direction(cosine, 0.7f);
      const SampleCheck check = check_samples(bsdf, out);
      const double exact = reflected(bsdf, out);
      CAPTURE(i, cosine, check.surplus, check.mean_weight.x, exact, check.worst_pdf_error);
      CHECK(check.surplus < 5);
      CHECK(check.worst_pdf_error < 1e-4);
      CHECK(check.mean_weight.x == Approx(exact).epsilon(0.01));
      // The others point below the surface.
      const double density =
          integrate([&](const glm::vec3& in) { return double(bsdf.pdf(out, in)); });
      CHECK(density == Approx(check.valid_share).margin(0.01));
      CHECK(density < 1.002);
    }
  }
}

TEST_CASE("Principled: reciprocal") {
  for (const Parameters& parameters : examples()) {
    const pt::Bsdf bsdf = make(parameters);
    CHECK(worst_reciprocity_error(bsdf) < 1e-4);
  }
}

TEST_CASE("Principled: white conserves energy, a coat over white nearly, none gains") {
  for (const float metallic : {0.0f, 0.5f, 1.0f}) {
    for (const float roughness : {0.2f, 0.5f, 1.0f}) {
      for (const float cosine : {0.15f, 0.5f, 1.0f}) {
        Parameters p{.color = glm::vec3(1), .roughness = roughness, .metallic = metallic};
        const glm::vec3 out = direction(cosine, 0);
        const double bare = reflected(make(p), out);
        p.coat = 1, p.coat_roughness = 0.3f;
        const double coated = reflected(make(p), out);
        p.color = glm::vec3(0.5f);
        const double gray = reflected(make(p), out);
        CAPTURE(metallic, roughness, cosine, bare, coated, gray);
        CHECK(bare == Approx(1).margin(0.01));
        CHECK(coated < 1.005);
        CHECK(coated > 0.94);
        CHECK(gray < coated - 0.1);
      }
    }
  }
}

TEST_CASE("Principled: a smooth metal reflects its color, a smooth plastic by Fresnel") {
  const glm::vec3 gold(1, 0.7f, 0.3f);
  const glm::vec3 out = direction(1, 0);
  const pt::Bsdf metal = make({.color = gold, .roughness = 0.2f, .metallic = 1});
  const glm::dvec3 found =
      integrate([&](const glm::vec3& in) { return glm::dvec3(metal.eval(out, in)); });
  for (int c = 0; c < 3; ++c) CHECK(found[c] == Approx(gold[c]).margin(0.01));
  CHECK(reflected(make({.roughness = 0.2f}), out) == Approx(0.04).margin(0.002));
  CHECK(reflected(make({.roughness = 0.2f, .specular = 0.5f}), out) == Approx(0.02).margin(0.001));
}

TEST_CASE("A principled white ball in a furnace conserves energy") {
  for (const float metallic : {0.0f, 1.0f}) {
    for (const float roughness : {0.0f, 0.4f, 1.0f}) {
      pt::Material material;
      material.type = pt::MaterialType::principled;
      material.color = glm::vec3(1);
      material.roughness = roughness;
      material.metallic = metallic;
      pt::Scene scene = make_scene(make_sphere(24), material, {0, 0, 4}, 15);
      scene.environment = uniform_light(glm::vec3(1));
      const pt::Image image = pt::render(scene, small_settings(16, 128));
      const float found = mean_color(image).x;
      CAPTURE(metallic, roughness, found);
      CHECK(save_unless(std::abs(found - 1) < 0.006f, image, "furnace-principled"));
    }
  }
}

TEST_CASE("All inputs of a material come from one query of its solid texture") {
  const TemporaryFolder folder;
  const auto file = (folder / "maps.solidtex").string();
  write_noise_model(file, 0, {"a", "b", "c", "d", "e"});
  pt::Scene scene;
  scene.textures.emplace_back(file);
  pt::Material material;
  material.type = pt::MaterialType::principled;
  material.color = glm::vec3(0.25f);
  material.channels_of = pt::SolidColor{0, false, glm::dmat4(1)};
  material.roughness = pt::SolidChannel{4};
  material.metallic = pt::SolidChannel{3};
  material.specular = 0.75f;
  material.coat = pt::SolidChannel{0};
  scene.images.push_back({"", 1, 1, {{0.1f, 0.2f, 0.3f}}});
  material.coat_roughness = pt::ImageChannel{0, 1};
  scene.materials = {material};

  std::vector<pt::SurfaceInteraction> interactions(20);
  for (std::size_t i = 0; i < interactions.size(); ++i) {
    interactions[i].object_position = glm::vec3(0.37f, 0.71f, 1.1f) * static_cast<float>(i);
  }
  std::vector<pt::MaterialSample> found(interactions.size());
  pt::MaterialEvaluator lookup(scene, pt::TextureFilter::footprint);
  CHECK(lookup(interactions, found) == interactions.size());
  const solidtex::texture texture(file);
  for (std::size_t i = 0; i < interactions.size(); ++i) {
    const glm::vec3& p = interactions[i].object_position;
    const std::array<float, 3> point = {p.x, p.y, p.z};
    std::array<float, 5> value;
    texture.eval_points({0, 0, 0}, point, value);
    CHECK(found[i].color == glm::vec3(0.25f));
    CHECK(found[i].roughness == value[4]);
    CHECK(found[i].metallic == value[3]);
    CHECK(found[i].specular == 0.75f);
    CHECK(found[i].coat == value[0]);
    CHECK(found[i].coat_roughness == 0.2f);
  }
}
