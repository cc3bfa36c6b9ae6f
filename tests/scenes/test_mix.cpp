// Mixes: solid textures blended by an attribute, an image or a distance.
#include <cmath>
#include <cstring>
#include <glm/gtc/matrix_transform.hpp>

#include "catch.hpp"
#include "plugins/pathtracer/materials/material_sample.h"
#include "plugins/pathtracer/materials/mix.h"
#include "plugins/pathtracer/materials/textures.h"
#include "plugins/pathtracer/scene/color.h"
#include "tests/scenes/support.h"

using namespace scene_tests;
using nlohmann::json;
using Shape = pt::ShapeDistance::Shape;

namespace {

// A mix of textures 0 to n - 1.
pt::SolidColor mix_of(std::size_t count, const decltype(pt::Mix::by)& by) {
  pt::SolidColor color;
  pt::Mix& mix = color.mix.emplace();
  for (std::size_t i = 0; i < count; ++i) mix.textures.push_back(i);
  mix.by = by;
  return color;
}

float place_at(const pt::SolidColor& color, const glm::vec3& position) {
  pt::SurfaceInteraction interaction;
  interaction.object_position = position;
  return pt::place_on_walk({}, color, glm::dvec3(0), interaction);
}

json mix_scene(const json& by) {
  json scene = json::parse(R"({
    "version": 1,
    "camera": {"position": [0, 4, 0.1], "look_at": [0, 0, 0], "fov": 30},
    "materials": {"stone": {"type": "diffuse", "color": {
      "mix": ["a.solidtex", "b.solidtex"], "texels_per_unit": 16}}},
    "objects": [{"mesh": "quad.obj", "material": "stone"}],
    "environment": {"color": [1, 1, 1]}
  })");
  scene["materials"]["stone"]["color"]["by"] = by;
  return scene;
}

void write_files(const TemporaryFolder& folder) {
  write_noise_model(folder / "a.solidtex", 0);
  write_noise_model(folder / "b.solidtex", 2);
  write_ply(folder / "quad.ply", make_quad(1));
  write_obj(folder / "quad.obj", make_quad(1));
  pt::write_exr(pt::Image{2, 1, {0, 0.5f, 0, 0, 0.5f, 1}}, folder / "mask.exr");
}

pt::Image render(const TemporaryFolder& folder, const json& scene, int threads = 0) {
  write_text(folder / "scene.json", scene.dump());
  pt::RenderSettings settings = small_settings(48, 4);
  settings.threads = threads;
  return pt::render(*pt::load_scene(folder / "scene.json"), settings);
}

bool same_bits(const pt::Image& a, const pt::Image& b) {
  return std::memcmp(a.rgb.data(), b.rgb.data(), a.rgb.size() * sizeof(float)) == 0;
}

std::string refusal(const TemporaryFolder& folder, const json& scene) {
  write_text(folder / "scene.json", scene.dump());
  try {
    pt::load_scene(folder / "scene.json");
  } catch (const pt::SceneError& error) {
    return error.what();
  }
  return "(accepted)";
}

}  // namespace

TEST_CASE("Distances to shapes choose the place on a walk") {
  pt::SolidColor plane = mix_of(3, pt::ShapeDistance{});
  CHECK(place_at(plane, {5, 6, 0.25f}) == 0.5f);
  CHECK(place_at(plane, {0, 0, -3}) == 0);
  CHECK(place_at(plane, {0, 0, 7}) == 2);
  plane.mix->range = {2, 0};
  CHECK(place_at(plane, {0, 0, 0.5f}) == 1.5f);

  const pt::ShapeDistance sphere{Shape::sphere, glm::dvec3(2), glm::dmat4(1)};
  CHECK(place_at(mix_of(2, sphere), {0, 2.25f, 0}) == 0.25f);
  CHECK(place_at(mix_of(2, sphere), {1, 0, 0}) == 0);

  const pt::ShapeDistance box{Shape::box, {1, 2, 3}, glm::dmat4(1)};
  CHECK(place_at(mix_of(2, box), {1.3f, 2.4f, 0}) == Approx(0.5f));  // from an edge
  CHECK(place_at(mix_of(2, box), {0, 0, 3.25f}) == 0.25f);
  pt::SolidColor inside = mix_of(2, box);
  inside.mix->range = {-1, 0};
  CHECK(place_at(inside, {0.5f, 0, 0}) == 0.5f);

  const glm::dmat4 moved = glm::translate(glm::dmat4(1), glm::dvec3(-10, 0, 0));
  const pt::ShapeDistance away{Shape::sphere, glm::dvec3(1), moved};
  CHECK(place_at(mix_of(2, away), {10, 1.5f, 0}) == 0.5f);
}

TEST_CASE("Shares of a walk's textures add up to one at every place") {
  for (float place = 0; place <= 4; place += 0.0625f) {
    float sum = 0;
    int count = 0;
    for (std::size_t k = 0; k < 5; ++k) {
      sum += pt::share_at(place, k);
      count += pt::share_at(place, k) > 0 ? 1 : 0;
    }
    CHECK(sum == 1);
    CHECK(count <= 2);
  }
}

TEST_CASE("A mix is its textures at the ends, and has their contrast between them") {
  const TemporaryFolder folder;
  write_noise_model(folder / "noise.solidtex", 0);
  pt::Scene scene;
  for (const std::uint64_t seed : {0, 1}) {
    scene.textures.emplace_back((folder / "noise.solidtex").string(),
                                solidtex::options{.seed = seed});
  }
  pt::SolidColor color = mix_of(2, pt::VertexAttribute{"wear"});
  for (const auto& texture : scene.textures) color.mix->means.push_back(pt::mean_albedo(texture));
  scene.materials.resize(1);
  scene.materials[0].color = color;

  const std::size_t count = 6000;
  std::vector<pt::SurfaceInteraction> interactions(count);
  for (std::size_t i = 0; i < count; ++i) {
    const float t = static_cast<float>(i);
    interactions[i].object_position = glm::vec3(0.5f) + glm::floor(glm::vec3(t, t / 20, 3 * t));
    interactions[i].attribute = i % 3 == 0 ? 0.0f : i % 3 == 1 ? 0.5f : 1.0f;
  }
  std::vector<pt::MaterialSample> found(count);
  pt::MaterialEvaluator lookup(scene, pt::TextureFilter::none);
  CHECK(lookup(interactions, found) == count / 3 * 4);  // two points in the middle

  std::array<double, 3> sums{}, squares{};
  for (std::size_t i = 0; i < count; ++i) {
    const double value = found[i].color.y;
    sums[i % 3] += value, squares[i % 3] += value * value;
    if (i % 3 == 1 || i > 60) continue;
    const glm::vec3& p = interactions[i].object_position;
    std::array<float, 3> expected;
    scene.textures[i % 3 == 0 ? 0 : 1].eval_points({0, 0, 0}, std::array{p.x, p.y, p.z}, expected);
    const float linear = pt::srgb_to_linear(glm::clamp(glm::vec3(expected[1]), 0.0f, 1.0f)).x;
    CHECK(found[i].color.y == Approx(std::min(linear, pt::kMaxTextureAlbedo)).margin(1e-5));
  }
  std::array<double, 3> deviations{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double mean = sums[k] * 3 / count;
    deviations[k] = std::sqrt(squares[k] * 3 / count - mean * mean);
  }
  CAPTURE(deviations[0], deviations[1], deviations[2]);
  CHECK(deviations[0] > 0.2);
  CHECK(deviations[1] == Approx(deviations[0]).epsilon(0.08));  // a plain mean: 0.71 of it
}

TEST_CASE("A mix by an image") {
  const TemporaryFolder folder;
  write_files(folder);
  const json mask = {{"image", "mask.exr"}, {"channel", "b"}};
  const pt::Image mixed = render(folder, mix_scene(mask));
  for (const int threads : {1, 3})
    CHECK(same_bits(mixed, render(folder, mix_scene(mask), threads)));
  // Green is 0.5 everywhere: the middle, or with this range an end.
  const auto green = [&](const json& range) {
    return render(folder, mix_scene({{"image", "mask.exr"}, {"channel", "g"}, {"range", range}}));
  };
  json plain = mix_scene(mask);
  plain["materials"]["stone"]["color"] = {{"solid", "a.solidtex"}, {"texels_per_unit", 16}};
  CHECK(same_bits(green({0.5, 1}), render(folder, plain)));
  plain["materials"]["stone"]["color"]["solid"] = "b.solidtex";
  plain["materials"]["stone"]["color"]["seed"] = 1;
  CHECK(same_bits(green({0, 0.5}), render(folder, plain)));
  CHECK(!same_bits(green({0, 1}), render(folder, plain)));
}

TEST_CASE("A mix in world space does not move with its object") {
  const TemporaryFolder folder;
  write_files(folder);
  json scene = mix_scene({{"plane", {{"point", {0, -5, 0}}, {"normal", {0, -1, 0}}}}});
  const auto is_first = [&](const char* space, double y) {
    scene["materials"]["stone"]["color"]["space"] = space;
    scene["objects"][0]["transform"] = json::array({{{"translate", {0, y, 0}}}});
    scene["camera"]["position"] = {0, 4 + y, 0.1};
    scene["camera"]["look_at"] = {0, y, 0};
    json plain = scene;
    plain["materials"]["stone"]["color"] = {
        {"solid", "a.solidtex"}, {"texels_per_unit", 16}, {"space", space}};
    return same_bits(render(folder, scene), render(folder, plain));
  };
  CHECK(is_first("object", 0));
  CHECK(is_first("object", -10));
  CHECK(is_first("world", 0));
  CHECK(!is_first("world", -10));
}

TEST_CASE("Mixes that a scene may not have") {
  const TemporaryFolder folder;
  write_files(folder);
  write_noise_model(folder / "gray.solidtex", 0, {"roughness"});
  const json by = {{"sphere", 1}};
  const std::string color = "/materials/stone/color";
  struct Case {
    std::string place;
    json value;
    std::string words;
  };
  const Case cases[] = {
      {color + "/mix", {"a.solidtex"}, "/mix: found [\"a.solidtex\"], expected an array of 2 to"},
      {color + "/mix", {"a.solidtex", "no"}, "/mix: no model is named \"no\""},
      {color + "/mix", {"a.solidtex", "gray.solidtex"}, "expected also albedo.r"},
      {color + "/by", json::object(), "/by: found {}, expected an object with one of"},
      {color + "/by", {{"sphere", 1}, {"box", 1}}, "expected an object with one of"},
      {color + "/by", {{"sphere", 1}, {"range", {1, 1}}}, "/by/range: found [1,1], expected two"},
      {color + "/by", {{"sphere", 1}, {"channel", "r"}}, "a key that requires \"image\""},
      {color + "/by",
       {{"attribute", "a"}, {"transform", json::array()}},
       "a key that requires \"sphere\" or \"box\""},
      {color + "/by",
       {{"plane", {{"point", {0, 0, 0}}, {"normal", {0, 0, 0}}}}},
       "/by/plane/normal: found [0,0,0], expected a direction"},
      {color + "/by", {{"attribute", "wear"}}, "found vertices with x, y, z"},
      {color + "/levels", 4, "/levels: found levels of a mix of outputs"},
      {color + "/blend", "codes", "a.solidtex: found a model of no texture space"},
      {color + "/solid", "a.solidtex", "either \"solid\" or \"image\" or \"mix\""},
      {"/materials/stone/bump", {{"channel", "albedo.r"}, {"depth", 1}}, "a channel of a mix"},
  };
  for (const Case& bad : cases) {
    json scene = mix_scene(by);
    scene["objects"][0]["mesh"] = "quad.ply";
    scene[json::json_pointer(bad.place)] = bad.value;
    const std::string message = refusal(folder, scene);
    CAPTURE(bad.place, bad.value.dump(), message);
    CHECK(message.find(bad.words) != std::string::npos);
  }
  json scene = mix_scene({{"attribute", "wear"}});
  CHECK(refusal(folder, scene).find("quad.obj: found a .obj file, expected a .ply file") !=
        std::string::npos);
  scene["objects"][0]["cuts"] = json::array({{{"subtract", {{"sphere", 1}}}}});
  CHECK(refusal(folder, scene).find("/cuts: found cuts of a mesh whose vertices have the") !=
        std::string::npos);
}
