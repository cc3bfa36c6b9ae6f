// Colours of a scene file, with the images and solid textures that they name.
#pragma once

#include <map>
#include <tuple>

#include "plugins/pathtracer/reader/image_io.h"
#include "plugins/pathtracer/reader/scene_file.h"
#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

// Puts what it loads into the scene; what is named several times is loaded once.
class TextureReader {
 public:
  TextureReader(const SceneFile& file, Scene& scene) : file_(file), scene_(scene) {}

  Color color(const Place& place);

  // A solid texture that channels are taken of; it need not have a color.
  SolidColor solid(const Place& place);

  // A number, or a channel of an image or of `solid`, which may be null.
  Input input(const Place& place, const SolidColor* solid);

 private:
  std::size_t load_image(const Place& place, ImageEncoding encoding);
  std::size_t load_texture(const Place& place);
  std::string model_of(const Place& place) const;

  const SceneFile& file_;
  Scene& scene_;
  std::map<std::pair<std::string, ImageEncoding>, std::size_t> images_;
  std::map<std::tuple<std::string, std::uint64_t, std::string>, std::size_t> textures_;
};

}  // namespace solidtex::pathtracer
