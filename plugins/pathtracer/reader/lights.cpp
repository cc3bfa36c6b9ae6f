// Reads "environment" and "lights".
#include <algorithm>
#include <cmath>

#include "plugins/pathtracer/reader/image_reader.h"
#include "plugins/pathtracer/reader/meshes.h"
#include "plugins/pathtracer/reader/parts.h"
#include "plugins/pathtracer/reader/schema.h"

namespace solidtex::pathtracer {
namespace {

using nlohmann::json;

// The width is horizontal; along x if the light faces straight up or down.
RectangleLight make_rectangle(const glm::vec3& center, const glm::vec3& direction, float width,
                              float height, const glm::vec3& radiance) {
  const glm::vec3 horizontal = glm::cross(glm::vec3(0, 1, 0), direction);
  const glm::vec3 u =
      glm::length(horizontal) > 1e-4f ? glm::normalize(horizontal) : glm::vec3(1, 0, 0);
  const glm::vec3 v = glm::cross(direction, u);
  return {center - 0.5f * (width * u + height * v), width * u, height * v, radiance};
}

RectangleLight read_rectangle(const SceneFile& file, const Scene& scene, const Place& place) {
  file.check_keys(place, "a rectangular light", {"position", "look_at", "size", "radiance"}, {});
  const json& light = file.at(place);
  const glm::vec3 position = to_render_space(scene, light["position"]);
  const glm::vec3 direction = to_render_space(scene, light["look_at"]) - position;
  if (glm::length(direction) == 0) {
    file.refuse(place / "look_at", quote_json(light["look_at"]),
                "a point that is not the light's position");
  }
  return make_rectangle(position, glm::normalize(direction), light["size"][0], light["size"][1],
                        to_vec3(light["radiance"]));
}

SphereLight read_sphere(const SceneFile& file, const Scene& scene, const Place& place) {
  file.check_keys(place, "a spherical light", {"sphere", "position", "radiance"}, {});
  const json& light = file.at(place);
  return {to_render_space(scene, light["position"]), light["sphere"], to_vec3(light["radiance"])};
}

MeshLight read_mesh(const SceneFile& file, const Scene& scene, MeshReader& meshes,
                    const Place& place) {
  file.check_keys(place, "a light of a mesh", {"mesh", "radiance"}, {"transform"});
  const json& light = file.at(place);
  MeshLight result{meshes.read_mesh(place / "mesh"), to_vec3(light["radiance"])};
  transform_mesh(result.mesh, file.transform(place / "transform"), scene.origin);
  double area = 0;
  for (const glm::uvec3& t : result.mesh.triangles) {
    const auto& p = result.mesh.positions;
    area += glm::length(glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x])) / 2;
  }
  if (!(area > 0) || !std::isfinite(area)) {
    file.refuse(place / "mesh", "a mesh without area", "a surface that can emit light");
  }
  return result;
}

void read_light(const SceneFile& file, Scene& scene, MeshReader& meshes, const Place& place) {
  const json& light = file.at(place);
  if (light.contains("sphere")) {
    scene.sphere_lights.push_back(read_sphere(file, scene, place));
  } else if (light.contains("mesh")) {
    scene.mesh_lights.push_back(read_mesh(file, scene, meshes, place));
  } else {
    scene.lights.push_back(read_rectangle(file, scene, place));
  }
  if (to_vec3(light["radiance"]) == glm::vec3(0)) {
    file.refuse(place / "radiance", quote_json(light["radiance"]), "a radiance above 0");
  }
}

}  // namespace

void read_environment(const SceneFile& file, Scene& scene) {
  if (!file.has("environment")) return;
  const Place place("/environment");
  const json& environment = file.at(place);
  EnvironmentImage result;
  if (environment.contains("file")) {
    result.image = file.load(place / "file", [&] {
      return read_image(file.resolve(place / "file"), ImageEncoding::automatic,
                        ImageRange::radiance, scene.notes);
    });
  } else {
    result.image = {"", 1, 1, {to_vec3(environment["color"])}};
  }
  result.rotation_degrees = environment.value("rotation", 0.0f);
  const float scale = environment.value("scale", 1.0f);
  float max_radiance = 0;
  for (glm::vec3& pixel : result.image.pixels) {
    pixel *= scale;
    max_radiance = std::max({max_radiance, pixel.x, pixel.y, pixel.z});
  }
  if (!(max_radiance > 0) || !std::isfinite(max_radiance)) {
    file.refuse(place, max_radiance > 0 ? "infinite radiance" : "no radiance above 0",
                "finite radiance above 0, or no \"environment\"");
  }
  scene.environment = std::move(result);
}

void read_lights(const SceneFile& file, Scene& scene) {
  if (!file.has("lights")) return;
  const Place place("/lights");
  const std::size_t count = file.at(place).size();
  MeshReader meshes(file, scene);
  for (std::size_t i = 0; i < count; ++i) read_light(file, scene, meshes, place / i);
}

}  // namespace solidtex::pathtracer
