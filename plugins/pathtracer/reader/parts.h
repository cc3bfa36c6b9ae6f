// Readers of the parts of a scene file. All throw SceneError, naming the place, for errors that the
// schema cannot express. Materials must be read before objects.
#pragma once

#include "plugins/pathtracer/reader/scene_file.h"
#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

// Converts a position from world space to render space.
inline glm::vec3 to_render_space(const Scene& scene, const nlohmann::json& position) {
  return glm::vec3(to_dvec3(position) - scene.origin);
}

void read_settings(const SceneFile& file, Scene& scene);
void read_camera(const SceneFile& file, Scene& scene);
void read_materials(const SceneFile& file, Scene& scene);
void read_objects(const SceneFile& file, Scene& scene);
void read_environment(const SceneFile& file, Scene& scene);
void read_lights(const SceneFile& file, Scene& scene);

}  // namespace solidtex::pathtracer
