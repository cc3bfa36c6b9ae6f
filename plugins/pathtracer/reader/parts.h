// Readers of the parts of a scene file. All throw SceneError, naming the place, for errors that the
// schema cannot express. Materials must be read before objects.
#pragma once

#include "plugins/pathtracer/reader/scene_file.h"
#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

void read_settings(const SceneFile& file, Scene& scene);
void read_camera(const SceneFile& file, Scene& scene);
void read_materials(const SceneFile& file, Scene& scene);
void read_objects(const SceneFile& file, Scene& scene);
void read_environment(const SceneFile& file, Scene& scene);
void read_lights(const SceneFile& file, Scene& scene);

}  // namespace solidtex::pathtracer
