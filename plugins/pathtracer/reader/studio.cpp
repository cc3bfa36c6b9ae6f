#include "plugins/pathtracer/reader/studio.h"

#include <algorithm>
#include <cmath>
#include <solidtex/solidtex.hpp>
#include <sstream>

#include "plugins/mesh/placement.h"
#include "plugins/pathtracer/reader/scene_file.h"

namespace solidtex::pathtracer {
namespace {

using nlohmann::json;

// Of a mesh: texels per unit of a scene are 1e-6 to 1e6.
constexpr double kLeastSide = mesh::kDefaultExtent * 1e-6;
constexpr double kLargestSide = mesh::kDefaultExtent * 1e6;

json to_json(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

bool has_channel(const solidtex::texture& texture, const std::string& name) {
  for (std::size_t i = 0; i < texture.channel_count(); ++i) {
    if (texture.channel_name(i) == name) return true;
  }
  return false;
}

// Uses all channels of the model that a principled material knows.
json material_of(const MeshScene& scene, double texels_per_unit) {
  const solidtex::texture texture(scene.model);
  if (!has_channel(texture, "albedo.r")) {
    throw SceneError("--model: found " + scene.model + ", whose channels begin with " +
                     texture.channel_name(0) +
                     ", expected a model with colors; solidtex-bake --preview shows others");
  }
  const bool is_path =
      scene.model.find('/') != std::string::npos || scene.model.ends_with(".solidtex");
  const std::string model = is_path ? std::filesystem::absolute(scene.model).string() : scene.model;
  json material = {
      {"type", "principled"},
      {"color", {{"solid", model}, {"seed", scene.seed}, {"texels_per_unit", texels_per_unit}}}};
  for (const char* input : {"roughness", "metallic"}) {
    if (has_channel(texture, input)) material[input] = {{"channel", input}};
  }
  if (has_channel(texture, "height")) {
    material["bump"] = {{"channel", "height"}, {"depth", mesh::kDefaultRelief / texels_per_unit}};
  }
  return material;
}

// Radius of the sphere around the vertices whose center is that of their box.
double radius_of(const mesh::Mesh& mesh, const glm::dvec3& center) {
  double radius = 0;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    radius = std::max(radius, glm::length(mesh.position(i) - center));
  }
  return radius;
}

// The whole sphere is visible, from slightly above and from the right, in any turn of the camera.
json camera_of(const glm::dvec3& center, double radius, double aspect) {
  constexpr double kFov = 30;
  const double distance = radius / std::sin(glm::radians(kFov / 2)) / std::min(1.0, aspect);
  const glm::dvec3 direction = glm::normalize(glm::dvec3(0.5, 0.45, 1));
  return {{"position", to_json(center + distance * direction)},
          {"look_at", to_json(center)},
          {"fov", kFov}};
}

// Whether a direction of the camera is undefined; the reader of cameras refuses that.
bool is_degenerate(const json& camera) {
  const glm::dvec3 view = to_dvec3(camera["look_at"]) - to_dvec3(camera["position"]);
  return glm::length(glm::cross(view, to_dvec3(camera.value("up", json{0, 1, 0})))) == 0;
}

}  // namespace

bool needs_studio(const json& document) {
  if (document["objects"].empty() || is_degenerate(document["camera"])) return false;
  if (document.contains("environment") || !document.value("lights", json::array()).empty()) {
    return false;
  }
  return std::ranges::none_of(document["materials"],
                              [](const json& material) { return material.contains("emission"); });
}

void add_studio(json& document) {
  const json& camera = document["camera"];
  const glm::dvec3 center = to_dvec3(camera["look_at"]);
  const glm::dvec3 view = center - to_dvec3(camera["position"]);
  const double distance = glm::length(view);
  const glm::dvec3 up_direction = to_dvec3(camera.value("up", json{0, 1, 0}));
  const glm::dvec3 right = glm::normalize(glm::cross(view, up_direction));
  const glm::dvec3 forward = view / distance, up = glm::cross(right, forward);
  const auto light = [&](const glm::dvec3& place, double size, const json& radiance) {
    const glm::dvec3 offset = place.x * right + place.y * up + place.z * forward;
    return json{{"position", to_json(center + distance * offset)},
                {"look_at", to_json(center)},
                {"size", {distance * size, distance * size}},
                {"radiance", radiance}};
  };
  document["environment"] = {{"color", {0.26, 0.28, 0.31}}};
  document["lights"] = {light({-0.9, 1.3, -0.5}, 0.8, {12, 11.4, 10.4}),
                        light({1.3, 0.9, 0.1}, 0.6, {5, 5.6, 6.4})};
}

json document_of(const MeshScene& scene) {
  const mesh::Mesh mesh = mesh::load_mesh(scene.mesh);
  const mesh::Box box = mesh::bounding_box(mesh);
  const double longest = mesh::longest_side(mesh);
  if (!scene.texels_per_unit && (longest < kLeastSide || longest > kLargestSide)) {
    std::ostringstream text;
    text << mesh.file << ": found a mesh whose longest side is " << longest << " units, expected "
         << kLeastSide << " to " << kLargestSide << ": scale it, or give --texels-per-unit";
    throw mesh::MeshError(text.str());
  }
  const double texels_per_unit = scene.texels_per_unit.value_or(mesh::kDefaultExtent / longest);
  glm::dvec3 center = 0.5 * (box.low + box.high);
  const double radius = radius_of(mesh, center);
  json transform = json::array();
  if (scene.z_is_up) {
    transform.push_back({{"rotate", {{"axis", {1, 0, 0}}, {"degrees", -90}}}});
    center = {center.x, center.z, -center.y};
  }
  return {{"version", 1},
          {"camera", camera_of(center, radius, scene.aspect)},
          {"materials", {{"model", material_of(scene, texels_per_unit)}}},
          {"objects",
           {{{"mesh", scene.mesh.filename().string()},
             {"material", "model"},
             {"transform", transform}}}}};
}

}  // namespace solidtex::pathtracer
