// Reads "objects".
#include <algorithm>

#include "plugins/pathtracer/reader/meshes.h"
#include "plugins/pathtracer/reader/parts.h"
#include "plugins/pathtracer/reader/schema.h"

namespace solidtex::pathtracer {
namespace {

std::size_t find_material(const SceneFile& file, const Scene& scene, const Place& place) {
  const std::string name = file.at(place).get<std::string>();
  std::string names;
  for (std::size_t i = 0; i < scene.materials.size(); ++i) {
    if (scene.materials[i].name == name) return i;
    names += (names.empty() ? "" : ", ") + scene.materials[i].name;
  }
  file.refuse(place, quote_json(name), "the name of a material (" + names + ")");
}

bool has_image(const Material& material) {
  const auto is_image = [&](Input Material::*input) {
    return std::holds_alternative<ImageChannel>(material.*input);
  };
  return std::holds_alternative<ImageColor>(material.color) ||
         std::ranges::any_of(kInputs, is_image);
}

Object read_object(const SceneFile& file, const Scene& scene, MeshReader& meshes,
                   const Place& place) {
  Object object;
  object.mesh = meshes.mesh_of(place);
  object.material = find_material(file, scene, place / "material");
  if (file.at(place).contains("transform")) {
    object.to_world = glm::mat4(file.transform(place / "transform"));
  }
  const Material& material = scene.materials[object.material];
  if (has_image(material) && scene.meshes[object.mesh].uvs.empty()) {
    file.refuse(place / "mesh", "a mesh without texture coordinates",
                "some, because the material \"" + material.name + "\" has an image");
  }
  return object;
}

}  // namespace

void read_objects(const SceneFile& file, Scene& scene) {
  MeshReader meshes(file, scene);
  const Place place("/objects");
  const std::size_t count = file.at(place).size();
  for (std::size_t i = 0; i < count; ++i) {
    scene.objects.push_back(read_object(file, scene, meshes, place / i));
  }
}

}  // namespace solidtex::pathtracer
