// docs/scene-format.md matches the schema, and its examples render.
#include <set>
#include <sstream>

#include "catch.hpp"
#include "plugins/pathtracer/reader/schema.h"
#include "tests/scenes/support.h"

using namespace scene_tests;
using nlohmann::json;

namespace {

std::string documentation() { return read_text(SOLIDTEX_SOURCE "/docs/scene-format.md"); }

// Collects the keys under all "properties" of the schema.
void collect_keys(const json& schema, std::set<std::string>& keys) {
  if (!schema.is_structured()) return;
  if (schema.is_object() && schema.contains("properties")) {
    for (const auto& [key, unused] : schema["properties"].items()) keys.insert(key);
  }
  for (const json& part : schema) collect_keys(part, keys);
}

// Returns the words in backquotes in the first column of all tables.
std::set<std::string> documented_keys(const std::string& text) {
  std::set<std::string> keys;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("| `", 0) != 0) continue;
    const std::string column = line.substr(1, line.find(" |", 2) - 1);
    for (std::size_t start = column.find('`'); start != std::string::npos;) {
      const std::size_t end = column.find('`', start + 1);
      keys.insert(column.substr(start + 1, end - start - 1));
      start = column.find('`', end + 1);
    }
  }
  return keys;
}

}  // namespace

TEST_CASE("docs/scene-format.md lists exactly the keys of the schema") {
  std::set<std::string> keys;
  collect_keys(json::parse(pt::scene_schema_text()), keys);
  CHECK(keys.size() > 30);
  CHECK(documented_keys(documentation()) == keys);
}

TEST_CASE("The schema lists the renderer's texture filters") {
  const json schema = json::parse(pt::scene_schema_text());
  std::set<std::string> known, allowed;
  for (const auto& [name, unused] : pt::texture_filters()) known.insert(name);
  for (const json& name : schema["properties"]["render"]["properties"]["texture_filter"]["enum"]) {
    allowed.insert(name.get<std::string>());
  }
  CHECK(known == allowed);
}

TEST_CASE("The example in docs/scene-format.md renders") {
  const std::string text = documentation();
  const std::string fence = "```json\n";
  const std::size_t start = text.find(fence) + fence.size();
  json scene = json::parse(text.substr(start, text.find("\n```", start) - start));
  // The example refers to files in scenes/.
  const auto file =
      std::filesystem::path(SOLIDTEX_SOURCE) / "scenes" / "documentation-example.json";
  CHECK(json::parse(read_text(file)) == scene);
  const auto loaded = pt::load_scene(file);
  pt::RenderSettings settings = pt::settings_of(*loaded);
  settings.width = 48, settings.height = 27, settings.samples = 4;
  const pt::Image image = pt::render(*loaded, settings);
  const float brightness = mean_color(image).x;
  CAPTURE(brightness);
  CHECK(save_unless(brightness > 0.05f && brightness < 2, image, "documentation-example"));
}

TEST_CASE("The snippets of materials and lights in docs/scene-format.md render") {
  std::string text = documentation();
  const auto snippet = [&](const std::string& first, const std::string& last) {
    const std::size_t start = text.find("\n    " + first);
    REQUIRE(start != std::string::npos);
    return text.substr(start, text.find(last, start + 1) + last.size() - start);
  };
  json scene = json::parse(read_text(SOLIDTEX_SOURCE "/scenes/documentation-example.json"));
  scene.erase("environment");
  std::string paint = "{";
  paint += snippet("\"paint\": {", "\n    }");
  paint += "}";
  scene["materials"].update(json::parse(paint));
  for (json& object : scene["objects"]) object["material"] = "paint";
  scene["lights"] = {
      json::parse(snippet("{\"sphere\"", "\n")),
      json::parse(snippet("{\"mesh\": \"meshes/ball-cut.ply\", \"radiance\"", "]}\n"))};
  text = scene.dump();
  for (std::size_t at = 0; (at = text.find("\"meshes/", at)) != std::string::npos; ++at) {
    text.insert(at + 1, SOLIDTEX_SOURCE "/scenes/");
  }
  const TemporaryFolder folder;
  write_text(folder / "scene.json", text);
  const auto loaded = pt::load_scene(folder / "scene.json");
  CHECK(loaded->sphere_lights.size() == 1);
  CHECK(loaded->mesh_lights.size() == 1);
  CHECK(loaded->materials[loaded->objects[0].material].bump->depth == 0.01f);
  pt::RenderSettings settings = small_settings(12, 1);
  const pt::Image image = pt::render(*loaded, settings);
  const float brightness = mean_color(image).x;
  CAPTURE(brightness);
  CHECK(save_unless(brightness > 0.01f && brightness < 5, image, "documentation-snippets"));
}

TEST_CASE("The scenes of the repository render") {
  for (const std::string name : {"demo", "carved", "horizon", "zoom"}) {
    if (name == "carved" && !built_with_cgal()) continue;
    const auto scene = pt::load_scene(SOLIDTEX_SOURCE "/scenes/" + name + ".json");
    pt::RenderSettings settings = pt::settings_of(*scene);
    settings.height = settings.height * 24 / settings.width;
    settings.width = 24, settings.samples = 1;
    const pt::Image image = pt::render(*scene, settings);
    const float brightness = mean_color(image).x;
    CAPTURE(name, brightness);
    CHECK(save_unless(brightness > 0.05f && brightness < 2, image, name));
  }
}

TEST_CASE("The scenes of the gallery render") {
  if (!built_with_cgal()) return;
  for (const std::string name :
       {"ball", "block", "bowl", "chess", "column", "rust", "sawn", "teapot"}) {
    const auto scene = pt::load_scene(SOLIDTEX_SOURCE "/docs/scenes/" + name + ".json");
    pt::RenderSettings settings = pt::settings_of(*scene);
    CHECK(settings.samples >= 64);
    settings.height = settings.height * 16 / settings.width;
    // Few points: nearly every point needs its own brick.
    settings.width = 16, settings.samples = 1, settings.max_depth = 3;
    settings.texture_filter = pt::TextureFilter::none;
    const pt::Image image = pt::render(*scene, settings);
    const float brightness = mean_color(image).x;
    CAPTURE(name, brightness);
    CHECK(save_unless(brightness > 0.05f && brightness < 2, image, name));
  }
}
