// Reads "mix": blends of solid textures over a surface.
#include "plugins/pathtracer/materials/mix.h"

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>

#include "plugins/pathtracer/materials/textures.h"
#include "plugins/pathtracer/reader/schema.h"
#include "plugins/pathtracer/reader/texture_reader.h"
#include "plugins/spaces/mixture.h"

namespace solidtex::pathtracer {
namespace {

using nlohmann::json;

constexpr std::size_t kDefaultLevels = 8;
constexpr std::uint64_t kCacheBytes = 1ull << 30;  // of all textures of a mix together

solidtex::options options_of(const json& color, std::size_t texture_count) {
  solidtex::options options;
  options.seed = color.value("seed", options.seed);
  options.precision = color.value("precision", options.precision);
  options.cache_limit_bytes = std::min(options.cache_limit_bytes, kCacheBytes / texture_count);
  return options;
}

// From the plane's coordinates, in which it is z = 0, to those of the scene file.
glm::dmat4 frame_of_plane(const json& plane) {
  const glm::dvec3 z = glm::normalize(to_dvec3(plane["normal"]));
  const glm::dvec3 aside = std::abs(z.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 x = glm::normalize(glm::cross(aside, z)), y = glm::cross(z, x);
  return {glm::dvec4(x, 0), glm::dvec4(y, 0), glm::dvec4(z, 0),
          glm::dvec4(to_dvec3(plane["point"]), 1)};
}

}  // namespace

SolidColor TextureReader::mix(const Place& place) {
  SolidColor result;
  place_texture(place, result);
  Mix& mix = result.mix.emplace();
  file_.load(place / "mix", [&] { open_mix(place, mix); });
  result.texture = mix.textures.front();
  const json& by = file_.at(place / "by");
  if (by.contains("attribute")) {
    mix.by = VertexAttribute{by["attribute"]};
  } else if (by.contains("image")) {
    mix.by = image_channel(place / "by");
  } else {
    mix.by = distance(place / "by");
  }
  if (!by.contains("range")) return result;
  mix.range = {by["range"][0], by["range"][1]};
  if (mix.range.x == mix.range.y) {
    file_.refuse(place / "by" / "range", quote_json(by["range"]), "two different numbers");
  }
  return result;
}

ShapeDistance TextureReader::distance(const Place& place) {
  using Shape = ShapeDistance::Shape;
  const json& by = file_.at(place);
  if (by.contains("plane")) {
    if (to_dvec3(by["plane"]["normal"]) == glm::dvec3(0)) {
      file_.refuse(place / "plane" / "normal", quote_json(by["plane"]["normal"]), "a direction");
    }
    return {Shape::plane, glm::dvec3(1), glm::inverse(frame_of_plane(by["plane"]))};
  }
  const glm::dmat4 to_shape = glm::inverse(file_.transform(place / "transform"));
  if (by.contains("sphere")) return {Shape::sphere, to_scale(by["sphere"]), to_shape};
  return {Shape::box, 0.5 * to_scale(by["box"]), to_shape};
}

// Codes of a lattice change it steadily. The transforms of a sampler depend on its code, so that
// its levels agree only near the origin of the texel space: its codes are blended on request only.
void TextureReader::open_mix(const Place& place, Mix& mix) {
  const json& color = file_.at(place);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < color["mix"].size(); ++i) {
    names.push_back(resolved(place / "mix" / i));
  }
  const std::string blend = color.value("blend", "");
  if (blend != "outputs") {
    try {
      const Place space = place / "texture_space";
      const spaces::Mixture mixture(names, color.contains("texture_space") ? resolved(space) : "",
                                    "texture_space");
      if (blend == "codes" || mixture.space().family() == SOLIDTEX_FAMILY_LATTICE) {
        return open_levels(place, mixture, mix);
      }
    } catch (const spaces::MixtureError& error) {
      if (blend == "codes") throw SceneError(error.what());
      const std::string reason = error.what();
      scene_.notes.push_back("mix of outputs, not of codes: " +
                             reason.substr(0, reason.find(", expected")));
    }
  }
  open_outputs(place, names, mix);
}

void TextureReader::open_levels(const Place& place, const spaces::Mixture& mixture, Mix& mix) {
  const std::size_t steps = file_.at(place).value("levels", kDefaultLevels) * (mixture.size() - 1);
  const solidtex::options options = options_of(file_.at(place), steps + 1);
  for (std::size_t i = 0; i <= steps; ++i) {
    const double position = static_cast<double>(i) / static_cast<double>(steps);
    const auto material = mixture.blend(spaces::weights_at(position, mixture.size()));
    add_texture(mixture.space().open(material, "", options), mix);
  }
}

// Different seeds make the textures independent.
void TextureReader::open_outputs(const Place& place, const std::vector<std::string>& names,
                                 Mix& mix) {
  if (file_.at(place).contains("levels")) {
    file_.refuse(place / "levels", "levels of a mix of outputs", "none, or \"blend\": \"codes\"");
  }
  solidtex::options options = options_of(file_.at(place), names.size());
  for (const std::string& name : names) {
    add_texture(spaces::open_material(name, options), mix);
    ++options.seed;
  }
  for (const std::size_t texture : mix.textures) {
    mix.means.push_back(mean_albedo(scene_.textures[texture]));
  }
}

void TextureReader::add_texture(solidtex::texture texture, Mix& mix) {
  albedo_channels(texture);  // throws if it has none
  mix.textures.push_back(scene_.textures.size());
  scene_.textures.push_back(std::move(texture));
}

}  // namespace solidtex::pathtracer
