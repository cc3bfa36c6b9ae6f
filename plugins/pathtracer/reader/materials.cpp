// Reads "materials".
#include <map>

#include "plugins/pathtracer/reader/parts.h"
#include "plugins/pathtracer/reader/schema.h"
#include "plugins/pathtracer/reader/texture_reader.h"

namespace solidtex::pathtracer {
namespace {

using nlohmann::json;

struct Kind {
  MaterialType type;
  SceneFile::Keys required, optional;  // besides the common ones
};

const std::map<std::string, Kind>& kinds() {
  static const std::map<std::string, Kind> list = {
      {"diffuse", {MaterialType::diffuse, {"color"}, {"emission"}}},
      {"coated", {MaterialType::coated, {"color"}, {"emission", "roughness", "ior"}}},
      {"principled",
       {MaterialType::principled,
        {"color"},
        {"emission", "roughness", "ior", "metallic", "specular", "coat", "coat_roughness"}}},
      {"dielectric", {MaterialType::dielectric, {}, {"color", "roughness", "ior"}}}};
  return list;
}

// Defaults of each type.
Material default_material(MaterialType type) {
  Material material;
  material.type = type;
  if (type == MaterialType::principled) material.roughness = 0.5f;
  if (type == MaterialType::dielectric) {
    material.roughness = 0.0f;
    material.color = glm::vec3(1);
  }
  return material;
}

void check_keys(const SceneFile& file, const Place& place, const std::string& type) {
  Kind kind = kinds().at(type);
  kind.required.push_back("type");
  kind.optional.insert(kind.optional.end(), {"channels_of", "bump"});
  file.check_keys(place, "\"type\": \"" + type + "\"", kind.required, kind.optional);
}

// Returns the solid texture of the material's channels, or null.
const SolidColor* read_solid(const SceneFile& file, TextureReader& textures, const Place& place,
                             Material& material) {
  const auto* of_color = std::get_if<SolidColor>(&material.color);
  if (!file.at(place).contains("channels_of")) return of_color;
  const Place own = place / "channels_of";
  if (of_color) {
    file.refuse(
        own, "a second solid texture",
        "none, because \"color\" has one (its channels can be used without \"channels_of\")");
  }
  if (!file.at(own).contains("solid")) {
    file.refuse(own, quote_json(file.at(own)), "an object with \"solid\"");
  }
  return &material.channels_of.emplace(textures.solid(own));
}

Material read_material(const SceneFile& file, TextureReader& textures, const Place& place) {
  const json& value = file.at(place);
  const std::string type = value["type"];
  check_keys(file, place, type);
  Material material = default_material(kinds().at(type).type);
  material.ior = value.value("ior", material.ior);
  if (value.contains("emission")) material.emission = to_vec3(value["emission"]);
  if (value.contains("color")) material.color = textures.color(place / "color");
  const SolidColor* solid = read_solid(file, textures, place, material);
  const std::pair<const char*, Input*> inputs[] = {{"roughness", &material.roughness},
                                                   {"metallic", &material.metallic},
                                                   {"specular", &material.specular},
                                                   {"coat", &material.coat},
                                                   {"coat_roughness", &material.coat_roughness}};
  for (const auto& [key, input] : inputs) {
    if (value.contains(key)) *input = textures.input(place / key, solid);
  }
  if (value.contains("bump")) {
    const auto height = std::get<SolidChannel>(textures.input(place / "bump", solid));
    material.bump = Bump{height.channel, value["bump"]["depth"]};
  }
  return material;
}

}  // namespace

void read_materials(const SceneFile& file, Scene& scene) {
  TextureReader textures(file, scene);
  const Place place("/materials");
  for (const auto& [name, unused] : file.at(place).items()) {
    Material material = read_material(file, textures, place / name);
    material.name = name;
    scene.materials.push_back(std::move(material));
  }
}

}  // namespace solidtex::pathtracer
