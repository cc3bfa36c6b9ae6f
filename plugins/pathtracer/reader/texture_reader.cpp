#include "plugins/pathtracer/reader/texture_reader.h"

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>

#include "plugins/pathtracer/materials/textures.h"

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

}  // namespace

Color TextureReader::color(const Place& place) {
  const json& color = file_.at(place);
  if (color.is_array()) return to_vec3(color);
  if (color.contains("mix")) return mix(place);
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
  if (value.contains("image")) return image_channel(place);
  if (!solid) {
    file_.refuse(place, "a channel for a material without a solid texture",
                 "a \"solid\" in \"color\" or \"channels_of\"");
  }
  if (solid->mix) {
    file_.refuse(place, "a channel of a mix, which gives colors only", "a number or an image");
  }
  return SolidChannel{file_.load(place / "channel", [&] {
    return channel_index(scene_.textures[solid->texture], value["channel"]);
  })};
}

ImageChannel TextureReader::image_channel(const Place& place) {
  const std::string names = "rgb", channel = file_.at(place).value("channel", "r");
  if (channel.size() != 1 || names.find(channel) == std::string::npos) {
    file_.refuse(place / "channel", "\"" + channel + "\"", "\"r\", \"g\" or \"b\" of an image");
  }
  // Not a color: never decoded.
  return {load_image(place / "image", ImageEncoding::linear),
          static_cast<int>(names.find(channel))};
}

SolidColor TextureReader::solid(const Place& place) {
  SolidColor result;
  result.texture = load_texture(place);
  place_texture(place, result);
  return result;
}

void TextureReader::place_texture(const Place& place, SolidColor& result) {
  const json& color = file_.at(place);
  result.world_space = color.value("space", "object") == "world";
  if (color.contains("transform")) result.to_texels = file_.transform(place / "transform");
  result.fits_object = !states_scale(color);
  const glm::dvec3 texels = to_scale(color.value("texels_per_unit", json(1.0)));
  result.to_texels = glm::scale(glm::dmat4(1), texels) * result.to_texels;
}

std::size_t TextureReader::load_image(const Place& place, ImageEncoding encoding) {
  const std::filesystem::path file = file_.resolve(place);
  const auto key = std::make_pair(file.string(), encoding);
  if (const auto known = images_.find(key); known != images_.end()) return known->second;
  scene_.images.push_back(file_.load(
      place, [&] { return read_image(file, encoding, ImageRange::unit, scene_.notes); }));
  return images_[key] = scene_.images.size() - 1;
}

// As in the engine, a name with a slash or the extension of a model or a space is a path, otherwise
// a shipped file. SPACE:PHOTOGRAPH may begin with a path.
std::string TextureReader::resolved(const Place& place) const {
  const std::string name = file_.at(place).get<std::string>();
  const bool is_path = name.find('/') != std::string::npos || name.ends_with(".solidtex") ||
                       name.find(".solidtex-space") != std::string::npos;
  return is_path ? file_.resolve(place).string() : name;
}

std::size_t TextureReader::load_texture(const Place& place) {
  const json& color = file_.at(place);
  const std::string model = resolved(place / "solid");
  const std::uint64_t seed = color.value("seed", std::uint64_t{0});
  const std::string precision = color.value("precision", "full");
  const auto key = std::make_tuple(model, seed, precision);
  if (const auto known = textures_.find(key); known != textures_.end()) return known->second;
  scene_.textures.push_back(file_.load(place / "solid", [&] {
    return solidtex::texture(model, {.seed = seed, .precision = precision});
  }));
  return textures_[key] = scene_.textures.size() - 1;
}

}  // namespace solidtex::pathtracer
