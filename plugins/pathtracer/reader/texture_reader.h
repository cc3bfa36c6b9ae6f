// Reads colors and inputs of materials, with their images, solid textures and mixes.
#pragma once

#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "plugins/pathtracer/reader/image_reader.h"
#include "plugins/pathtracer/reader/scene_file.h"
#include "plugins/pathtracer/scene/scene.h"
#include "plugins/spaces/mixture.h"

namespace solidtex::pathtracer {

// Loads images and solid textures into the scene, each once.
class TextureReader {
 public:
  TextureReader(const SceneFile& file, Scene& scene) : file_(file), scene_(scene) {}

  Color color(const Place& place);

  // A solid texture, with or without albedo.
  SolidColor solid(const Place& place);

  // A number, or a channel of an image or of `solid`, which may be null.
  Input input(const Place& place, const SolidColor* solid);

 private:
  SolidColor mix(const Place& place);
  void open_mix(const Place& place, Mix& mix);
  void open_levels(const Place& place, const spaces::Mixture& mixture, Mix& mix);
  void open_outputs(const Place& place, const std::vector<std::string>& names, Mix& mix);
  void add_texture(solidtex::texture texture, Mix& mix);
  ShapeDistance distance(const Place& place);
  ImageChannel image_channel(const Place& place);
  void place_texture(const Place& place, SolidColor& solid);
  std::size_t load_image(const Place& place, ImageEncoding encoding);
  std::size_t load_texture(const Place& place);
  std::string resolved(const Place& place) const;

  const SceneFile& file_;
  Scene& scene_;
  std::map<std::pair<std::string, ImageEncoding>, std::size_t> images_;
  std::map<std::tuple<std::string, std::uint64_t, std::string>, std::size_t> textures_;
};

}  // namespace solidtex::pathtracer
