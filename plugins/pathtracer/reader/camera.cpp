// Reads "render" and "camera".
#include "plugins/pathtracer/reader/parts.h"
#include "plugins/pathtracer/reader/schema.h"

namespace solidtex::pathtracer {

using nlohmann::json;

const std::map<std::string, TextureFilter>& texture_filters() {
  static const std::map<std::string, TextureFilter> names = {
      {"footprint", TextureFilter::footprint},
      {"stochastic", TextureFilter::stochastic},
      {"none", TextureFilter::none},
      {"anisotropic", TextureFilter::anisotropic}};
  return names;
}

void read_settings(const SceneFile& file, Scene& scene) {
  if (!file.has("render")) return;
  const json& render = file.at(Place("/render"));
  RenderSettings& settings = scene.settings;
  if (render.contains("size")) {
    settings.width = render["size"][0];
    settings.height = render["size"][1];
  }
  settings.samples = render.value("spp", settings.samples);
  settings.noise = render.value("noise", settings.noise);
  settings.seed = render.value("seed", settings.seed);
  settings.max_depth = render.value("max_depth", settings.max_depth);
  if (render.contains("texture_filter")) {
    settings.texture_filter = texture_filters().at(render["texture_filter"]);
  }
  scene.display.exposure = render.value("exposure", scene.display.exposure);
  if (render.contains("view_transform")) {
    scene.display.transform = view_transforms().at(render["view_transform"]);
  }
}

void read_camera(const SceneFile& file, Scene& scene) {
  const Place place("/camera");
  const json& camera = file.at(place);
  Camera& result = scene.camera;
  result.position = to_render_space(scene, camera["position"]);
  result.look_at = to_render_space(scene, camera["look_at"]);
  if (camera.contains("up")) result.up = to_vec3(camera["up"]);
  result.fov_degrees = camera["fov"];
  result.aperture = camera.value("aperture", result.aperture);
  result.focus_distance = camera.value("focus_distance", result.focus_distance);
  if (camera.contains("focus_distance") && result.aperture == 0) {
    file.refuse(place / "focus_distance",
                "a distance for a pinhole camera, which has no focal plane",
                "an \"aperture\" above 0 beside it");
  }
  const glm::vec3 forward = result.look_at - result.position;
  if (glm::length(forward) == 0) {
    file.refuse(place / "look_at", quote_json(camera["look_at"]),
                "a point that is not the camera's position");
  }
  if (glm::length(glm::cross(forward, result.up)) <=
      1e-6f * glm::length(forward) * glm::length(result.up)) {
    file.refuse(
        camera.contains("up") ? place / "up" : place,
        "the up direction " + quote_json(camera.value("up", json{0, 1, 0})) + " along the view",
        "another direction");
  }
}

}  // namespace solidtex::pathtracer
