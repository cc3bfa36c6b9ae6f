// Animated scenes: interpolation, reloading, turntables, invalid tracks.
#include <cmath>

#include "catch.hpp"
#include "plugins/pathtracer/reader/animation.h"
#include "tests/scenes/support.h"

using namespace scene_tests;
using nlohmann::json;

namespace {

json animated_scene() {
  return json::parse(R"({
    "version": 1,
    "render": {"size": [24, 16], "spp": 4},
    "camera": {"position": [0, 3, 6], "look_at": [0, 0, 0], "fov": 40},
    "animation": {
      "frames": 13,
      "tracks": {
        "/camera/position": {"0": [0, 3, 6], "4": [4, 3, 6], "12": [0, 3, 8], "10": [6, 3, 8]},
        "/objects/0/cuts/0/clip/point": {"2": [0, 0.5, 0], "6": [0, -0.5, 0]}
      }
    },
    "materials": {"gray": {"type": "diffuse", "color": [0.5, 0.5, 0.5]}},
    "objects": [{"mesh": "cube.ply", "material": "gray",
                 "cuts": [{"clip": {"point": [0, 0.5, 0], "normal": [0, 1, 0]}}]}],
    "environment": {"color": [1, 1, 1]}
  })");
}

std::string load(const TemporaryFolder& folder, const json& scene) {
  write_text(folder / "scene.json", scene.dump());
  pt::Sequence sequence(folder / "scene.json");
  return std::to_string(sequence.frame_count());
}

}  // namespace

TEST_CASE("Tracks interpolate their keys smoothly and are constant outside") {
  const json scene = animated_scene();
  const auto position = [&](double frame) {
    return pt::document_at(scene, frame)["camera"]["position"].get<std::vector<double>>();
  };
  CHECK(position(0) == std::vector<double>{0, 3, 6});
  CHECK(position(4) == std::vector<double>{4, 3, 6});
  CHECK(position(10) == std::vector<double>{6, 3, 8});
  CHECK(position(12) == std::vector<double>{0, 3, 8});
  CHECK(position(20) == position(12));
  // Between equal keys the value is constant.
  for (double frame = 0; frame <= 12; frame += 0.25) CHECK(position(frame)[1] == Approx(3));
  // The derivative is continuous at keys: that of the neighbors' chord.
  const double h = 1e-4;
  for (const auto& [key, height_gradient] : {std::pair{4.0, 6.0 / 10}, {10.0, -4.0 / 8}}) {
    CHECK((position(key)[0] - position(key - h)[0]) / h == Approx(height_gradient).epsilon(1e-3));
    CHECK((position(key + h)[0] - position(key)[0]) / h == Approx(height_gradient).epsilon(1e-3));
  }
  // Two keys give a line.
  const auto cut = [&](double frame) {
    return pt::document_at(scene, frame)["objects"][0]["cuts"][0]["clip"]["point"][1].get<double>();
  };
  CHECK(cut(0) == 0.5);
  CHECK(cut(3) == Approx(0.25));
  CHECK(cut(5) == Approx(-0.25));
  CHECK(cut(12) == -0.5);
}

TEST_CASE("Each frame has its own camera and cuts") {
  if (!built_with_cgal()) return;
  const TemporaryFolder folder;
  write_ply(folder / "cube.ply", make_cube());
  CHECK(load(folder, animated_scene()) == "13");
  pt::Sequence sequence(folder / "scene.json");
  const auto volume = [&](int frame) { return signed_volume(sequence.frame(frame).meshes.at(0)); };
  CHECK(volume(0) == Approx(6));
  CHECK(volume(4) == Approx(4).epsilon(1e-5));
  CHECK(volume(12) == Approx(2).epsilon(1e-5));
  CHECK(sequence.frame(12).camera.position == glm::vec3(0, 3, 8));
  // A sequence that starts at this frame gives the same scene: earlier frames leave no trace.
  pt::Sequence fresh(folder / "scene.json");
  pt::RenderSettings settings = pt::settings_of(fresh.frame(4));
  const pt::Image expected = pt::render(fresh.frame(4), settings);
  CHECK(pt::render(sequence.frame(4), settings).rgb == expected.rgb);
  CHECK(pt::render(sequence.frame(0), settings).rgb != expected.rgb);
}

TEST_CASE("An animated camera keeps meshes and textures loaded") {
  const TemporaryFolder folder;
  write_ply(folder / "cube.ply", make_cube());
  write_noise_model(folder / "noise.solidtex", 2);
  json scene = animated_scene();
  scene["objects"][0].erase("cuts");
  scene["materials"]["gray"]["color"] = {{"solid", "noise.solidtex"}};
  scene["animation"]["tracks"].erase("/objects/0/cuts/0/clip/point");
  load(folder, scene);
  pt::Sequence sequence(folder / "scene.json");
  const pt::Scene& first = sequence.frame(0);
  const auto* mesh = first.meshes.data();
  const auto* texture = first.textures.data();
  const pt::Scene& later = sequence.frame(7);
  CHECK(later.meshes.data() == mesh);
  CHECK(later.textures.data() == texture);
  CHECK(later.camera.position != glm::vec3(0, 3, 6));
}

TEST_CASE("A turntable makes one revolution at constant height and distance") {
  const TemporaryFolder folder;
  write_ply(folder / "cube.ply", make_cube());
  json scene = animated_scene();
  scene["objects"][0].erase("cuts");
  scene.erase("animation");
  scene["camera"]["look_at"] = {1, 0, 2};
  load(folder, scene);
  pt::Sequence sequence(folder / "scene.json");
  CHECK(sequence.frame_count() == 1);
  sequence.set_turntable(8);
  CHECK(sequence.frame_count() == 8);
  const glm::vec3 center(1, 0, 2);
  const glm::vec3 start = sequence.frame(0).camera.position - center;
  CHECK(start == glm::vec3(-1, 3, 4));
  for (int frame = 0; frame < 8; ++frame) {
    const glm::vec3 place = sequence.frame(frame).camera.position - center;
    CHECK(place.y == Approx(3));
    CHECK(glm::length(place) == Approx(glm::length(start)));
  }
  // Counter-clockwise seen from above: from +z towards +x.
  const glm::vec3 quarter = sequence.frame(2).camera.position - center;
  CHECK(quarter.x == Approx(4));
  CHECK(quarter.z == Approx(1));
}

TEST_CASE("Invalid tracks are refused, naming their place") {
  const TemporaryFolder folder;
  write_ply(folder / "cube.ply", make_cube());
  const auto with = [&](const char* place, const json& value) {
    json scene = animated_scene();
    scene[json::json_pointer(place)] = value;
    return scene;
  };
  CHECK_THROWS_WITH(load(folder, with("/animation/tracks/~1camera~1size", {{"0", 1}})),
                    ContainsSubstring("/camera/size") && ContainsSubstring("place of a value"));
  CHECK_THROWS_WITH(load(folder, with("/animation/tracks/camera", {{"0", 1}})),
                    ContainsSubstring("place of a value"));
  CHECK_THROWS_WITH(
      load(folder, with("/animation/tracks/~1camera~1position/99", {0, 0, 0})),
      ContainsSubstring("/animation/tracks/~1camera~1position/99") && ContainsSubstring("0 to 12"));
  CHECK_THROWS_WITH(load(folder, with("/animation/tracks/~1camera~1position/1", {0, 0})),
                    ContainsSubstring("[0,0]") && ContainsSubstring("in the form of"));
  CHECK_THROWS_WITH(load(folder, with("/animation/tracks/~1camera~1position/x", {0, 0, 0})),
                    ContainsSubstring("/animation/tracks"));
  CHECK_THROWS_WITH(load(folder, with("/animation/frames", 0)),
                    ContainsSubstring("/animation/frames"));

  // Invalid between its keys only, where it overshoots.
  json scene = with("/animation/tracks", {{"/camera/fov", {{"0", 1}, {"2", 1}, {"4", 90}}}});
  scene["objects"][0].erase("cuts");
  load(folder, scene);
  pt::Sequence sequence(folder / "scene.json");
  CHECK_NOTHROW(sequence.frame(2));
  CHECK_THROWS_WITH(sequence.frame(1),
                    ContainsSubstring("(frame 1)") && ContainsSubstring("/camera/fov"));
}

TEST_CASE("The animation example in docs/scene-format.md loads") {
  if (!built_with_cgal()) return;
  const std::string text = read_text(SOLIDTEX_SOURCE "/docs/scene-format.md");
  const std::size_t start = text.find("    \"animation\": {");
  REQUIRE(start != std::string::npos);
  std::string snippet = "{";
  snippet += text.substr(start, text.find("\n\n", start) - start);
  snippet += "}";
  const json animation = json::parse(snippet);
  const TemporaryFolder folder;
  write_ply(folder / "cube.ply", make_cube());
  json scene = animated_scene();
  scene["animation"] = animation["animation"];
  load(folder, scene);
  pt::Sequence sequence(folder / "scene.json");
  CHECK(sequence.frame_count() == 48);
  CHECK(signed_volume(sequence.frame(0).meshes.at(0)) == Approx(8));
  CHECK(signed_volume(sequence.frame(47).meshes.at(0)) == Approx(4.8).epsilon(1e-5));
}
