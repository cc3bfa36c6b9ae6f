// Invalid scenes: errors name the file, the JSON path, what was found and what was expected.
#include <functional>

#include "catch.hpp"
#include "tests/scenes/support.h"

using namespace scene_tests;
using nlohmann::json;

namespace {

json good_scene() {
  return json::parse(R"({
    "version": 1,
    "render": {"size": [16, 12], "spp": 2},
    "camera": {"position": [0, 2, 6], "look_at": [0, 0, 0], "fov": 40},
    "materials": {
      "gray": {"type": "diffuse", "color": [0.5, 0.5, 0.5]},
      "noise": {"type": "coated", "color": {"solid": "noise.solidtex", "texels_per_unit": 10},
                "roughness": 0.3},
      "metal": {"type": "principled", "color": [1, 1, 1], "metallic": 1,
                "channels_of": {"solid": "noise.solidtex"}, "roughness": {"channel": "albedo.g"}},
      "glass": {"type": "dielectric"}
    },
    "objects": [
      {"mesh": "cube.ply", "material": "noise"},
      {"mesh": "cube.ply", "material": "gray", "transform": [{"translate": [2, 0, 0]}]}
    ],
    "environment": {"color": [1, 1, 1]},
    "lights": [{"position": [0, 5, 0], "look_at": [0, 0, 0], "size": [1, 1], "radiance": [9, 9, 9]}]
  })");
}

void write_good_files(const TemporaryFolder& folder) {
  write_ply(folder / "cube.ply", make_cube());
  write_noise_model(folder / "noise.solidtex", 2);
  write_text(folder / "broken.solidtex", "not a model");
  pt::write_exr(pt::Image{1, 1, {0, 0, 0}}, folder / "black.exr");
  pt::write_exr(pt::Image{1, 1, {1, -1, 0}}, folder / "negative.exr");
}

std::string refusal(const std::filesystem::path& file) {
  try {
    pt::load_scene(file);
  } catch (const pt::SceneError& error) {
    return error.what();
  }
  return "(accepted)";
}

// A change that makes the valid scene invalid, and the expected error.
struct BadScene {
  const char* place;  // JSON path to set ...
  json value;         // ... to this
  const char* path;   // JSON path in the error
  const char* words;  // other text in the error
};

const std::vector<BadScene>& bad_scenes() {
  static const json solid = {{"solid", "noise.solidtex"}};
  static const std::vector<BadScene> list = {
      {"/version", 2, "/version", "found 2, expected 1,"},
      {"/camera", json(), "/camera", "found null"},
      {"/camera/fov", 0, "/camera/fov", "found 0, expected the vertical field of view"},
      {"/camera/fov", "wide", "/camera/fov", "found \"wide\""},
      {"/camera/position", {1, 2}, "/camera/position", "found [1,2], expected [x, y, z]"},
      {"/camera/position", {1, "2", 3}, "/camera/position/1", "found \"2\", expected a number"},
      {"/camera/position", {1, 1e300, 3}, "/camera/position/1", "expected a number from -1e9"},
      {"/camera/look_at", {0, 2, 6}, "/camera/look_at", "not the camera's position"},
      {"/camera/up", {0, 2, 6}, "/camera/up", "along the view"},
      {"/camera/zoom", 2, "/camera/zoom", "unknown key, expected one of aperture, focus_distance"},
      {"/camera/aperture", -0.1, "/camera/aperture", "found -0.1, expected the lens radius"},
      {"/camera/focus_distance", 3, "/camera/focus_distance", "\"aperture\" above 0 beside it"},
      {"/camera/focus_distance", 0, "/camera/focus_distance", "found 0, expected the distance"},
      {"/render/spp", 0, "/render/spp", "found 0, expected samples per pixel"},
      {"/render/spp", 1.5, "/render/spp", "found 1.5"},
      {"/render/spp", 2000000000, "/render/spp", "found 2000000000"},
      {"/render/size", {16, 0}, "/render/size/1", "found 0, expected a whole number"},
      {"/render/size", {16, 12, 3}, "/render/size", "[width, height]"},
      {"/render/noise", -0.1, "/render/noise", "found -0.1, expected the relative error"},
      {"/render/seed", -1, "/render/seed", "found -1"},
      {"/objects/0/cuts", {{"clip", 1}}, "/objects/0/cuts", "expected an array of cuts"},
      {"/objects/0/cuts", json::array({{{"drill", 1}}}), "/objects/0/cuts/0/drill", "unknown key"},
      {"/objects/0/cuts", json::array({{{"subtract", {{"box", 1}, {"sphere", 2}}}}}),
       "/objects/0/cuts/0/subtract", "one of"},
      {"/objects/0/cuts", json::array({{{"clip", {{"point", {0, 0, 0}}, {"normal", {0, 0, 0}}}}}}),
       "/objects/0/cuts/0/clip/normal", "found [0,0,0], expected a direction"},
      {"/objects/0/cuts", json::array({{{"subtract", {{"sphere", 0}}}}}),
       "/objects/0/cuts/0/subtract/sphere", "found 0, expected a radius"},
      {"/objects/0/cuts", json::array({{{"subtract", {{"mesh", "none.ply"}}}}}),
       "/objects/0/cuts/0/subtract/mesh", "no such file"},
      {"/materials", json::object(), "/materials", "at least one material"},
      {"/materials/gray", "gray", "/materials/gray", "found \"gray\", expected an object"},
      {"/materials/gray/type", "metal", "/materials/gray/type",
       "\"diffuse\", \"coated\", \"principled\" or"},
      {"/materials/gray/color", "red", "/materials/gray/color", "found \"red\", expected a linear"},
      {"/materials/gray/color", {1, 0, 2}, "/materials/gray/color/2", "a number from 0 to 1"},
      {"/materials/gray/color", {{"imag", "a"}}, "/materials/gray/color/imag", "unknown key"},
      {"/materials/gray/color", {{"seed", 1}}, "/materials/gray/color/seed", "requires \"solid\""},
      {"/materials/noise/color/precision", "half", "/materials/noise/color/precision",
       "found \"half\", expected \"full\" or \"fast\""},
      {"/materials/gray/color", json::object(), "/materials/gray/color", "either \"solid\" or"},
      {"/materials/gray/color",
       {{"image", "a.png"}, {"solid", "b"}},
       "/materials/gray/color",
       "either \"solid\" or \"image\""},
      {"/materials/gray/color", {{"image", "a.png"}}, "/materials/gray/color/image", "a.png"},
      {"/materials/gray/color",
       {{"solid", "no-such-model"}},
       "/materials/gray/color/solid",
       "no-such-model"},
      {"/materials/gray/color",
       {{"solid", "broken.solidtex"}},
       "/materials/gray/color/solid",
       "broken.solidtex"},
      {"/materials/noise/color/texels_per_unit", 0, "/materials/noise/color/texels_per_unit",
       "found 0"},
      {"/materials/noise/color/texels_per_unit",
       {1, 2, -3},
       "/materials/noise/color/texels_per_unit/2",
       "found -3"},
      {"/materials/noise/color/space", "uv", "/materials/noise/color/space", "\"object\""},
      {"/materials/noise/roughness", 2, "/materials/noise/roughness",
       "found 2, expected a number from 0 to 1"},
      {"/materials/gray/roughness", 0.5, "/materials/gray/roughness",
       "a key that does not go with \"type\": \"diffuse\", expected one of bump, channels_of"},
      {"/materials/noise/roughness",
       {{"channel", "wetness"}},
       "/materials/noise/roughness/channel",
       "found the channels albedo.r, albedo.g, albedo.b, expected also wetness"},
      {"/materials/noise/roughness", json::object(), "/materials/noise/roughness", "\"channel\""},
      {"/materials/noise/roughness", "high", "/materials/noise/roughness", "{\"channel\": name}"},
      {"/materials/noise",
       {{"type", "coated"}, {"color", {1, 0, 0}}, {"roughness", {{"channel", "x"}}}},
       "/materials/noise/roughness",
       "without a solid texture, expected a \"solid\" in"},
      {"/materials/noise/metallic", 1, "/materials/noise/metallic", "go with \"type\": \"coated\""},
      {"/materials/metal/metallic", 1.5, "/materials/metal/metallic",
       "found 1.5, expected a number"},
      {"/materials/metal/coat_roughness", -0.1, "/materials/metal/coat_roughness", "found -0.1"},
      {"/materials/metal/roughness",
       {{"channel", "rust"}},
       "/materials/metal/roughness/channel",
       "found the channels albedo.r, albedo.g, albedo.b, expected also rust"},
      {"/materials/metal/roughness",
       {{"image", "black.exr"}, {"channel", "x"}},
       "/materials/metal/roughness/channel",
       "found \"x\", expected \"r\", \"g\" or \"b\" of an image"},
      {"/materials/metal/coat", {{"image", "no.png"}}, "/materials/metal/coat/image", "no.png"},
      {"/materials/metal/channels_of",
       {1, 1, 1},
       "/materials/metal/channels_of",
       "found [1,1,1], expected an object with \"solid\""},
      {"/materials/noise/channels_of", solid, "/materials/noise/channels_of",
       "a second solid texture"},
      {"/materials/noise/bump",
       {{"channel", "height"}, {"depth", 0.1}},
       "/materials/noise/bump/channel",
       "found the channels albedo.r, albedo.g, albedo.b, expected also height"},
      {"/materials/noise/bump",
       {{"channel", "albedo.r"}},
       "/materials/noise/bump",
       "no key \"depth\""},
      {"/materials/gray/bump",
       {{"channel", "height"}, {"depth", 0.1}},
       "/materials/gray/bump",
       "a channel for a material without a solid texture"},
      {"/materials/glass/ior", 0.5, "/materials/glass/ior",
       "found 0.5, expected a refractive index"},
      {"/materials/glass/roughness", 2, "/materials/glass/roughness", "found 2"},
      {"/materials/glass/emission", {1, 1, 1}, "/materials/glass/emission", "\"dielectric\""},
      {"/materials/gray/emission", {1, -1, 0}, "/materials/gray/emission/1", "found -1"},
      {"/objects", json::object(), "/objects", "expected an array"},
      {"/objects/1/mesh", "missing.obj", "/objects/1/mesh", "missing.obj: found no such file"},
      {"/objects/1/mesh", 7, "/objects/1/mesh", "found 7, expected the name of a mesh file"},
      {"/objects/1/material", "granite", "/objects/1/material",
       "found \"granite\", expected the name of a material (glass, gray, metal, noise)"},
      {"/objects/1/color", 1, "/objects/1/color", "one of cuts, material, mesh, transform"},
      {"/objects/1/transform/0",
       {{"translate", {1, 2}}},
       "/objects/1/transform/0/translate",
       "found [1,2]"},
      {"/objects/1/transform/0", {{"turn", 3}}, "/objects/1/transform/0/turn", "one of matrix"},
      {"/objects/1/transform/0",
       {{"scale", 2}, {"translate", {1, 2, 3}}},
       "/objects/1/transform/0",
       "one of {\"scale\": s}"},
      {"/objects/1/transform/0", {{"scale", 0}}, "/objects/1/transform/0/scale", "found 0"},
      {"/objects/1/transform/0",
       {{"rotate", {{"axis", {0, 0, 0}}, {"degrees", 3}}}},
       "/objects/1/transform/0/rotate/axis",
       "a direction"},
      {"/objects/1/transform/0",
       {{"rotate", {{"degrees", 3}}}},
       "/objects/1/transform/0/rotate",
       "no key \"axis\""},
      {"/objects/1/transform/0",
       {{"matrix", {{1, 0, 0, 0}, {0, 1, 0, 0}, {1, 1, 0, 0}}}},
       "/objects/1/transform",
       "flattens space"},
      {"/environment", json::object(), "/environment", "either \"file\" or \"color\""},
      {"/environment/rotation", 30, "/environment/rotation", "requires \"file\""},
      {"/environment/color", {0, 0, 0}, "/environment", "no radiance above 0"},
      {"/environment", {{"file", "sky.exr"}}, "/environment/file", "sky.exr: found no such file"},
      {"/environment", {{"file", "cube.ply"}}, "/environment/file", "no image"},
      {"/environment", {{"file", "black.exr"}}, "/environment", "no radiance above 0"},
      {"/environment", {{"file", "negative.exr"}}, "/environment/file", "not below 0"},
      {"/lights/0/radiance", {0, 0, 0}, "/lights/0/radiance", "a radiance above 0"},
      {"/lights/0/look_at", {0, 5, 0}, "/lights/0/look_at", "not the light's position"},
      {"/lights/0/size", 3, "/lights/0/size", "found 3, expected [width, height]"},
      {"/lights/0", {{"position", {0, 5, 0}}}, "/lights/0", "no key \"radiance\""},
      {"/lights/0",
       {{"position", {0, 5, 0}}, {"radiance", {1, 1, 1}}},
       "/lights/0",
       "found no key \"look_at\", expected a rectangular light with the keys look_at, position"},
      {"/lights/0",
       {{"sphere", 0}, {"position", {0, 5, 0}}, {"radiance", {1, 1, 1}}},
       "/lights/0/sphere",
       "found 0, expected a radius"},
      {"/lights/0", {{"sphere", 1}, {"radiance", {1, 1, 1}}}, "/lights/0", "no key \"position\""},
      {"/lights/0",
       {{"sphere", 1}, {"position", {0, 5, 0}}, {"radiance", {0, 0, 0}}},
       "/lights/0/radiance",
       "a radiance above 0"},
      {"/lights/0",
       {{"sphere", 1}, {"mesh", "cube.ply"}, {"position", {0, 5, 0}}, {"radiance", {1, 1, 1}}},
       "/lights/0/mesh",
       "does not go with a spherical light"},
      {"/lights/0",
       {{"mesh", "none.ply"}, {"radiance", {1, 1, 1}}},
       "/lights/0/mesh",
       "no such file"},
      {"/lights/0",
       {{"mesh", "cube.ply"}, {"radiance", {0, 0, 0}}},
       "/lights/0/radiance",
       "a radiance above 0"},
      {"/lights/0",
       {{"mesh", "cube.ply"},
        {"radiance", {1, 1, 1}},
        {"transform", json::array({{{"scale", 0}}})}},
       "/lights/0/transform/0/scale",
       "found 0"},
      {"/sun", json::object(), "/sun", "unknown key, expected one of animation, camera"},
  };
  return list;
}

}  // namespace

TEST_CASE("The valid scene is accepted") {
  const TemporaryFolder folder;
  write_good_files(folder);
  write_text(folder / "scene.json", good_scene().dump());
  const auto scene = pt::load_scene(folder / "scene.json");
  CHECK(scene->meshes.size() == 1);  // two instances of one file
  CHECK(scene->objects.size() == 2);
  CHECK(pt::settings_of(*scene).width == 16);
  const pt::Image image = pt::render(*scene, pt::settings_of(*scene));
  CHECK(save_unless(mean_color(image).x > 0.1f, image, "good-scene"));
}

TEST_CASE("Errors name the JSON path, what was found and what was expected") {
  const TemporaryFolder folder;
  write_good_files(folder);
  const auto file = folder / "scene.json";
  for (const BadScene& bad : bad_scenes()) {
    json scene = good_scene();
    scene[json::json_pointer(bad.place)] = bad.value;
    write_text(file, scene.dump());
    const std::string message = refusal(file);
    CAPTURE(bad.place, bad.value.dump(), message);
    CHECK(message.find(file.string() + ": " + bad.path + ": ") == 0);
    CHECK(message.find(bad.words) != std::string::npos);
    if (std::string(bad.path).ends_with("/solid")) continue;  // the engine's error
    CHECK(message.find("found ") != std::string::npos);
    CHECK(message.find(", expected ") != std::string::npos);
  }
}

TEST_CASE("Missing keys are named") {
  const TemporaryFolder folder;
  write_good_files(folder);
  const auto file = folder / "scene.json";
  const std::pair<const char*, const char*> cases[] = {
      {"", "version"},        {"", "camera"},          {"", "materials"},
      {"", "objects"},        {"/camera", "position"}, {"/materials/gray", "color"},
      {"/objects/0", "mesh"}, {"/lights/0", "size"},   {"/objects/1", "material"}};
  for (const auto& [parent, key] : cases) {
    json scene = good_scene();
    scene[json::json_pointer(parent)].erase(key);
    write_text(file, scene.dump());
    const std::string message = refusal(file);
    CAPTURE(parent, key, message);
    CHECK(message.find(file.string() + ": " + (*parent ? parent : "/") + ": found no key \"" +
                       key) == 0);
  }
}

TEST_CASE("Invalid JSON and duplicate keys are refused") {
  const TemporaryFolder folder;
  const auto file = folder / "scene.json";
  for (const char* text : {"", "[", "{\"version\": 1,}", "{\"version\": 1e999}", "nonsense"}) {
    write_text(file, text);
    const std::string message = refusal(file);
    CAPTURE(text, message);
    CHECK(message.find(file.string() + ": found what is not JSON (") == 0);
    CHECK(message.find("json.exception") == std::string::npos);
  }
  write_text(file, R"({"version": 1, "version": 2})");
  CHECK(refusal(file).find("the key \"version\" twice") != std::string::npos);
  write_text(file, std::string(200000, '[') + std::string(200000, ']'));
  CHECK(refusal(file).find("more than 32 nested values") != std::string::npos);
  CHECK(refusal(folder / "missing.json").find("missing.json: found no readable file") !=
        std::string::npos);
  CHECK(refusal(folder.path()).find("found no readable file") != std::string::npos);
}

TEST_CASE("An image on a mesh without texture coordinates is refused") {
  const TemporaryFolder folder;
  write_good_files(folder);
  json scene = good_scene();
  scene["materials"]["gray"]["color"] = {{"image", "black.exr"}};
  write_text(folder / "scene.json", scene.dump());
  const std::string message = refusal(folder / "scene.json");
  CAPTURE(message);
  CHECK(message.find("/objects/1/mesh: found a mesh without texture coordinates") !=
        std::string::npos);
}

TEST_CASE("File names are relative to the scene file") {
  const TemporaryFolder folder;
  write_good_files(folder);
  std::filesystem::create_directory(folder / "below");
  write_text(folder / "below" / "scene.json", good_scene().dump());
  CHECK(refusal(folder / "below" / "scene.json").find("below/noise.solidtex") != std::string::npos);
}
