// Reads "materials", with their images and solid textures.
#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <tuple>

#include "plugins/pathtracer/materials/textures.h"
#include "plugins/pathtracer/reader/image_reader.h"
#include "plugins/pathtracer/reader/parts.h"
#include "plugins/pathtracer/reader/schema.h"

namespace solidtex::pathtracer {
namespace {

using nlohmann::json;

// Whether a solid texture has a scale of its own: without one it is scaled to its objects.
bool states_scale(const json& solid) {
  const auto scales = [](const json& step) {
    return step.contains("scale") || step.contains("matrix");
  };
  return solid.contains("texels_per_unit") ||
         std::ranges::any_of(solid.value("transform", json::array()), scales);
}

// Reads colors and inputs. Loads images and solid textures into the scene, each once.
class TextureReader {
 public:
  TextureReader(const SceneFile& file, Scene& scene) : file_(file), scene_(scene) {}

  Color color(const Place& place);

  // A solid texture, with or without albedo.
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

Color TextureReader::color(const Place& place) {
  const json& color = file_.at(place);
  if (color.is_array()) return to_vec3(color);
  if (!color.contains("image")) {
    const SolidColor result = solid(place);
    file_.load(place / "solid", [&] { return albedo_channels(scene_.textures[result.texture]); });
    return result;
  }
  const std::string space = color.value("color_space", "");
  return ImageColor{load_image(place / "image", space == "srgb"     ? ImageEncoding::srgb
                                                : space == "linear" ? ImageEncoding::linear
                                                                    : ImageEncoding::automatic)};
}

Input TextureReader::input(const Place& place, const SolidColor* solid) {
  const json& value = file_.at(place);
  if (value.is_number()) return value.get<float>();
  if (value.contains("image")) {
    const std::string names = "rgb", channel = value.value("channel", "r");
    if (channel.size() != 1 || names.find(channel) == std::string::npos) {
      file_.refuse(place / "channel", "\"" + channel + "\"", "\"r\", \"g\" or \"b\" of an image");
    }
    // Not a color: never decoded.
    return ImageChannel{load_image(place / "image", ImageEncoding::linear),
                        static_cast<int>(names.find(channel))};
  }
  if (!solid) {
    file_.refuse(place, "a channel for a material without a solid texture",
                 "a \"solid\" in \"color\" or \"channels_of\"");
  }
  return SolidChannel{file_.load(place / "channel", [&] {
    return channel_index(scene_.textures[solid->texture], value["channel"]);
  })};
}

SolidColor TextureReader::solid(const Place& place) {
  const json& color = file_.at(place);
  SolidColor result;
  result.texture = load_texture(place);
  result.world_space = color.value("space", "object") == "world";
  if (color.contains("transform")) result.to_texels = file_.transform(place / "transform");
  result.fits_object = !states_scale(color);
  const glm::dvec3 texels = to_scale(color.value("texels_per_unit", json(1.0)));
  result.to_texels = glm::scale(glm::dmat4(1), texels) * result.to_texels;
  return result;
}

std::size_t TextureReader::load_image(const Place& place, ImageEncoding encoding) {
  const std::filesystem::path file = file_.resolve(place);
  const auto key = std::make_pair(file.string(), encoding);
  if (const auto known = images_.find(key); known != images_.end()) return known->second;
  scene_.images.push_back(file_.load(
      place, [&] { return read_image(file, encoding, ImageRange::unit, scene_.notes); }));
  return images_[key] = scene_.images.size() - 1;
}

// As in the engine, a name with a slash or the extension .solidtex is a path, otherwise a shipped
// model.
std::string TextureReader::model_of(const Place& place) const {
  const std::string name = file_.at(place).get<std::string>();
  const bool is_path = name.find('/') != std::string::npos || name.ends_with(".solidtex");
  return is_path ? file_.resolve(place).string() : name;
}

std::size_t TextureReader::load_texture(const Place& place) {
  const json& color = file_.at(place);
  const std::string model = model_of(place / "solid");
  const std::uint64_t seed = color.value("seed", std::uint64_t{0});
  const std::string precision = color.value("precision", "full");
  const auto key = std::make_tuple(model, seed, precision);
  if (const auto known = textures_.find(key); known != textures_.end()) return known->second;
  scene_.textures.push_back(file_.load(place / "solid", [&] {
    return solidtex::texture(model, {.seed = seed, .precision = precision});
  }));
  return textures_[key] = scene_.textures.size() - 1;
}

struct Kind {
  MaterialType type;
  SceneFile::Keys required, optional;  // besides the common ones
};

const std::map<std::string, Kind>& kinds() {
  static const std::map<std::string, Kind> list = {
      {"diffuse", {MaterialType::diffuse, {"color"}, {"emission"}}},
      {"coated", {MaterialType::coated, {"color"}, {"emission", "roughness", "ior"}}},
      {"principled",
       {MaterialType::principled,
        {"color"},
        {"emission", "roughness", "ior", "metallic", "specular", "coat", "coat_roughness"}}},
      {"dielectric", {MaterialType::dielectric, {}, {"color", "roughness", "ior"}}}};
  return list;
}

// Defaults of each type.
Material default_material(MaterialType type) {
  Material material;
  material.type = type;
  if (type == MaterialType::principled) material.roughness = 0.5f;
  if (type == MaterialType::dielectric) {
    material.roughness = 0.0f;
    material.color = glm::vec3(1);
  }
  return material;
}

void check_keys(const SceneFile& file, const Place& place, const std::string& type) {
  Kind kind = kinds().at(type);
  kind.required.push_back("type");
  kind.optional.insert(kind.optional.end(), {"channels_of", "bump"});
  file.check_keys(place, "\"type\": \"" + type + "\"", kind.required, kind.optional);
}

// Returns the solid texture of the material's channels, or null.
const SolidColor* read_solid(const SceneFile& file, TextureReader& textures, const Place& place,
                             Material& material) {
  const auto* of_color = std::get_if<SolidColor>(&material.color);
  if (!file.at(place).contains("channels_of")) return of_color;
  const Place own = place / "channels_of";
  if (of_color) {
    file.refuse(
        own, "a second solid texture",
        "none, because \"color\" has one (its channels can be used without \"channels_of\")");
  }
  if (!file.at(own).contains("solid")) {
    file.refuse(own, quote_json(file.at(own)), "an object with \"solid\"");
  }
  return &material.channels_of.emplace(textures.solid(own));
}

Material read_material(const SceneFile& file, TextureReader& textures, const Place& place) {
  const json& value = file.at(place);
  const std::string type = value["type"];
  check_keys(file, place, type);
  Material material = default_material(kinds().at(type).type);
  material.ior = value.value("ior", material.ior);
  if (value.contains("emission")) material.emission = to_vec3(value["emission"]);
  if (value.contains("color")) material.color = textures.color(place / "color");
  const SolidColor* solid = read_solid(file, textures, place, material);
  const std::pair<const char*, Input*> inputs[] = {{"roughness", &material.roughness},
                                                   {"metallic", &material.metallic},
                                                   {"specular", &material.specular},
                                                   {"coat", &material.coat},
                                                   {"coat_roughness", &material.coat_roughness}};
  for (const auto& [key, input] : inputs) {
    if (value.contains(key)) *input = textures.input(place / key, solid);
  }
  if (value.contains("bump")) {
    const auto height = std::get<SolidChannel>(textures.input(place / "bump", solid));
    material.bump = Bump{height.channel, value["bump"]["depth"]};
  }
  return material;
}

}  // namespace

void read_materials(const SceneFile& file, Scene& scene) {
  TextureReader textures(file, scene);
  const Place place("/materials");
  for (const auto& [name, unused] : file.at(place).items()) {
    Material material = read_material(file, textures, place / name);
    material.name = name;
    scene.materials.push_back(std::move(material));
  }
}

}  // namespace solidtex::pathtracer
