// From a scene file to a Scene, part by part.
#include "plugins/pathtracer/reader/parts.h"

namespace solidtex::pathtracer {

std::shared_ptr<const Scene> load_scene(const std::filesystem::path& path) {
  const SceneFile file(path);
  const auto scene = std::make_shared<Scene>();
  read_settings(file, *scene);
  read_camera(file, *scene);
  read_materials(file, *scene);
  read_objects(file, *scene);
  read_environment(file, *scene);
  read_lights(file, *scene);
  if (scene->objects.empty() && scene->lights.empty() && scene->sphere_lights.empty() &&
      scene->mesh_lights.empty() && !scene->environment) {
    file.refuse(Place(), "nothing to see", "objects, lights or an environment");
  }
  return scene;
}

RenderSettings settings_of(const Scene& scene) { return scene.settings; }
float exposure_of(const Scene& scene) { return scene.exposure; }
std::vector<std::string> notes_of(const Scene& scene) { return scene.notes; }

}  // namespace solidtex::pathtracer
