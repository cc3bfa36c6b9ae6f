// Reads "objects".
#include <algorithm>
#include <cmath>

#include "plugins/pathtracer/materials/texel_space.h"
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

// Notes a mesh whose coordinates are rounded by much of a texel.
void note_rounding(Scene& scene, const Mesh& mesh, const Material& material,
                   const glm::dmat4& transform) {
  const SolidColor* solid = solid_texture_of(material);
  if (!solid) return;
  glm::dmat3 to_texels(solid->to_texels);
  if (solid->world_space) to_texels *= glm::dmat3(transform);
  const double texels_per_unit = std::cbrt(std::abs(glm::determinant(to_texels)));
  const std::string warning = mesh::rounding_warning(mesh, texels_per_unit);
  if (warning.empty()) return;
  scene.notes.push_back(std::filesystem::path(mesh.file).filename().string() + ": " + warning);
}

Object read_object(const SceneFile& file, Scene& scene, MeshReader& meshes, const Place& place) {
  Object object;
  object.mesh = meshes.mesh_of(place);
  object.material = find_material(file, scene, place / "material");
  const Mesh& mesh = scene.meshes[object.mesh];
  const glm::dmat4 transform = file.transform(place / "transform");
  object.to_world = glm::mat4(between_origins(transform, mesh.origin, scene.origin));
  const Material& material = scene.materials[object.material];
  note_rounding(scene, mesh, material, transform);
  if (has_image(material) && mesh.uvs.empty()) {
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
