// Colours of a scene file, with the images and solid textures that they name.
#pragma once

#include <map>
#include <tuple>

#include "plugins/pathtracer/reader/scene_file.h"
#include "plugins/pathtracer/scene.h"

namespace solidtex::pathtracer {

// Puts what it loads into the scene; a solid texture that several materials name is loaded once.
class TextureReader {
 public:
  TextureReader(const SceneFile& file, Scene& scene) : file_(file), scene_(scene) {}

  Color color(const Place& place);

 private:
  SolidColor solid(const Place& place);
  std::size_t load_image(const Place& place);
  std::size_t load_texture(const Place& place);
  std::string model_of(const Place& place) const;

  const SceneFile& file_;
  Scene& scene_;
  std::map<std::tuple<std::string, std::uint64_t, solidtex_precision>, std::size_t> textures_;
};

}  // namespace solidtex::pathtracer
