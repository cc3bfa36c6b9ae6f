// "materials".
#include "plugins/pathtracer/reader/parts.h"
#include "plugins/pathtracer/reader/textures.h"
#include "plugins/pathtracer/scene_transform.h"
#include "plugins/pathtracer/textures.h"

namespace solidtex::pathtracer {
namespace {

using nlohmann::json;

// A number, or a channel of the solid texture that the material's color comes from.
void read_roughness(const SceneFile& file, const Scene& scene, const Place& place,
                    Material& material) {
  const json& roughness = file.at(place);
  if (roughness.is_number()) {
    material.roughness = roughness;
    return;
  }
  const auto* solid = std::get_if<SolidColor>(&material.color);
  if (!solid) {
    file.refuse(place, "a channel for a color that is no solid texture",
                "a number, or a color with \"solid\"");
  }
  material.roughness_channel = roughness["channel"];
  file.load(place / "channel", [&] {
    return channel_index(scene.textures[solid->texture], material.roughness_channel);
  });
}

Material read_material(const SceneFile& file, const Scene& scene, TextureReader& textures,
                       const Place& place) {
  const json& value = file.at(place);
  Material material;
  material.type = value["type"] == "coated" ? MaterialType::coated : MaterialType::diffuse;
  for (const char* key : {"roughness", "ior"}) {
    if (material.type != MaterialType::coated && value.contains(key)) {
      file.refuse(place / key, "a key that goes with \"type\": \"coated\"",
                  "a coated material, or no such key");
    }
  }
  material.ior = value.value("ior", material.ior);
  if (value.contains("emission")) material.emission = to_vec3(value["emission"]);
  material.color = textures.color(place / "color");
  if (value.contains("roughness")) read_roughness(file, scene, place / "roughness", material);
  return material;
}

}  // namespace

void read_materials(const SceneFile& file, Scene& scene) {
  TextureReader textures(file, scene);
  const Place place("/materials");
  for (const auto& [name, unused] : file.at(place).items()) {
    Material material = read_material(file, scene, textures, place / name);
    material.name = name;
    scene.materials.push_back(std::move(material));
  }
}

}  // namespace solidtex::pathtracer
