// Reads "objects".
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <map>
#include <sstream>
#include <utility>

#include "plugins/mesh/placement.h"
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

// Returns what the color of a material is mixed by, or null if it is another kind or no mix.
template <class Kind>
const Kind* by_of(const Material& material) {
  const auto* color = std::get_if<SolidColor>(&material.color);
  return color && color->mix ? std::get_if<Kind>(&color->mix->by) : nullptr;
}

bool has_image(const Material& material) {
  const auto is_image = [&](Input Material::*input) {
    return std::holds_alternative<ImageChannel>(material.*input);
  };
  return std::holds_alternative<ImageColor>(material.color) ||
         std::ranges::any_of(kInputs, is_image) || by_of<ImageChannel>(material);
}

double texels_per_unit(const SolidColor& solid) {
  return std::cbrt(std::abs(glm::determinant(glm::dmat3(solid.to_texels))));
}

// Notes a mesh whose coordinates are rounded by much of a texel.
void note_rounding(Scene& scene, const Object& object) {
  const Mesh& mesh = scene.meshes[object.mesh];
  const SolidColor* solid = solid_texture_of(std::as_const(scene.materials[object.material]));
  if (!solid) return;
  double texels = texels_per_unit(*solid);
  if (solid->world_space) {
    texels *= std::cbrt(std::abs(glm::determinant(glm::dmat3(glm::mat3(object.to_world)))));
  }
  const std::string warning = mesh::rounding_warning(mesh, texels);
  if (warning.empty()) return;
  scene.notes.push_back(std::filesystem::path(mesh.file).filename().string() + ": " + warning);
}

Object read_object(const SceneFile& file, Scene& scene, MeshReader& meshes, const Place& place) {
  Object object;
  object.material = find_material(file, scene, place / "material");
  const auto* attribute = by_of<VertexAttribute>(scene.materials[object.material]);
  object.mesh = meshes.mesh_of(place, attribute ? attribute->name : "");
  const Mesh& mesh = scene.meshes[object.mesh];
  const glm::dmat4 transform = file.transform(place / "transform");
  object.to_world = glm::mat4(between_origins(transform, mesh.origin, scene.origin));
  const Material& material = scene.materials[object.material];
  if (material.type == MaterialType::dielectric && meshes.is_open(mesh)) {
    scene.notes.push_back(std::filesystem::path(mesh.file).filename().string() +
                          ": an open mesh of the dielectric \"" + material.name +
                          "\", which is right only for a closed one: fill its holes");
  }
  if (has_image(material) && mesh.uvs.empty()) {
    file.refuse(place / "mesh", "a mesh without texture coordinates",
                "some, because the material \"" + material.name + "\" has an image");
  }
  object.box = meshes.box_of(object.mesh);
  return object;
}

// Returns the box around an object in the space of its solid texture, up to a translation.
mesh::Box box_in(const Scene& scene, const Object& object, bool world_space) {
  if (!world_space) return object.box;
  const glm::dvec3& origin = scene.meshes[object.mesh].origin;
  mesh::Box box{glm::dvec3(std::numeric_limits<double>::max()),
                glm::dvec3(std::numeric_limits<double>::lowest())};
  for (int corner = 0; corner < 8; ++corner) {
    const glm::bvec3 is_high((corner & 1) != 0, (corner & 2) != 0, (corner & 4) != 0);
    const glm::dvec3 vertex = glm::mix(object.box.low, object.box.high, is_high) - origin;
    const glm::dvec3 p(glm::dmat4(object.to_world) * glm::dvec4(vertex, 1));
    box = {glm::min(box.low, p), glm::max(box.high, p)};
  }
  return box;
}

// Refuses an object that lies farther out in its solid texture than the engine evaluates.
void check_place(const SceneFile& file, const Place& place, const Scene& scene,
                 const Object& object) {
  constexpr double kFarthest = (1 << 30) + (1 << 16);  // texels, as solidtex.h says
  const SolidColor* solid = solid_texture_of(std::as_const(scene.materials[object.material]));
  if (!solid) return;
  const mesh::Box box = box_in(scene, object, solid->world_space);
  const glm::dvec3 shift = solid->world_space ? scene.origin : glm::dvec3(0);
  const glm::dvec3 far = glm::max(glm::abs(box.low + shift), glm::abs(box.high + shift));
  const double units = std::max({far.x, far.y, far.z}), texels = units * texels_per_unit(*solid);
  if (texels <= kFarthest) return;
  std::ostringstream found;
  found << "coordinates of up to " << units << " units, which are " << texels
        << " texels in the material \"" << scene.materials[object.material].name << '"';
  file.refuse(place / "mesh", found.str(),
              "at most 1073807360 texels: move the mesh nearer to its origin, or take fewer texels "
              "per unit");
}

// Gives objects with one material, and in object space one mesh, a copy of that material in which
// the longest side of their box has mesh::kDefaultExtent texels.
void fit_material(Scene& scene, const std::vector<Object*>& objects) {
  const Object& first = *objects.front();
  Material material = scene.materials[first.material];
  SolidColor& solid = *solid_texture_of(material);
  mesh::Box box = box_in(scene, first, solid.world_space);
  for (const Object* object : objects) {
    const mesh::Box other = box_in(scene, *object, solid.world_space);
    box = {glm::min(box.low, other.low), glm::max(box.high, other.high)};
  }
  if (!(box.longest_side() > 0)) return;
  const double texels = mesh::kDefaultExtent / box.longest_side();
  solid.to_texels = glm::scale(glm::dmat4(1), glm::dvec3(texels)) * solid.to_texels;
  const std::filesystem::path file = scene.meshes[first.mesh].file;
  std::ostringstream note;
  note << material.name << ": " << mesh::kDefaultExtent << " texels along the longest side of "
       << (solid.world_space ? "its objects" : file.filename().string())
       << ", \"texels_per_unit\": " << texels;
  scene.notes.push_back(note.str());
  for (Object* object : objects) object->material = scene.materials.size();
  scene.materials.push_back(std::move(material));
}

void fit_materials(Scene& scene) {
  std::map<std::pair<std::size_t, std::size_t>, std::vector<Object*>> groups;
  for (Object& object : scene.objects) {
    const SolidColor* solid = solid_texture_of(std::as_const(scene.materials[object.material]));
    if (!solid || !solid->fits_object) continue;
    groups[{object.material, solid->world_space ? 0 : object.mesh}].push_back(&object);
  }
  for (const auto& [unused, objects] : groups) fit_material(scene, objects);
}

}  // namespace

void read_objects(const SceneFile& file, Scene& scene) {
  MeshReader meshes(file, scene);
  const Place place("/objects");
  const std::size_t count = file.at(place).size();
  for (std::size_t i = 0; i < count; ++i) {
    scene.objects.push_back(read_object(file, scene, meshes, place / i));
  }
  fit_materials(scene);
  for (std::size_t i = 0; i < count; ++i) {
    check_place(file, place / i, scene, scene.objects[i]);
    note_rounding(scene, scene.objects[i]);
  }
}

}  // namespace solidtex::pathtracer
