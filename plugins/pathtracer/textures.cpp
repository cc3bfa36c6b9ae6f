#include "plugins/pathtracer/textures.h"

#include <cmath>
#include <string>

namespace solidtex::pathtracer {
namespace {

float decode(float x) { return x <= 0.04045f ? x / 12.92f : std::pow((x + 0.055f) / 1.055f, 2.4f); }

float encode(float x) {
  return x <= 0.0031308f ? x * 12.92f : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f;
}

constexpr float kLeastRadius = 0.25f;  // texels

glm::vec3 clamp_albedo(const glm::vec3& color) {
  return glm::clamp(color, 0.0f, kMaxTextureAlbedo);
}

}  // namespace

glm::vec3 srgb_to_linear(const glm::vec3& c) { return {decode(c.x), decode(c.y), decode(c.z)}; }
glm::vec3 linear_to_srgb(const glm::vec3& c) { return {encode(c.x), encode(c.y), encode(c.z)}; }

glm::vec3 lookup_image(const ColorImage& image, const glm::vec2& uv) {
  const float x = (uv.x - std::floor(uv.x)) * static_cast<float>(image.width) - 0.5f;
  const float y = (1 - (uv.y - std::floor(uv.y))) * static_cast<float>(image.height) - 0.5f;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const float tx = x - static_cast<float>(x0), ty = y - static_cast<float>(y0);
  const auto pixel = [&](int px, int py) {
    return image.at((px + image.width) % image.width, (py + image.height) % image.height);
  };
  return glm::mix(glm::mix(pixel(x0, y0), pixel(x0 + 1, y0), tx),
                  glm::mix(pixel(x0, y0 + 1), pixel(x0 + 1, y0 + 1), tx), ty);
}

std::size_t channel_index(const solidtex::texture& texture, const std::string& name) {
  std::string names;
  for (std::size_t c = 0; c < texture.channel_count(); ++c) {
    if (texture.channel_name(c) == name) return c;
    names += (c == 0 ? "" : ", ") + texture.channel_name(c);
  }
  throw SceneError(texture.path() + ": found the channels " + names + ", expected also " + name);
}

glm::uvec3 albedo_channels(const solidtex::texture& texture) {
  return {channel_index(texture, "albedo.r"), channel_index(texture, "albedo.g"),
          channel_index(texture, "albedo.b")};
}

AppearanceLookup::AppearanceLookup(const Scene& scene, TextureFilter filter)
    : scene_(scene), filter_(filter), waiting_(scene.materials.size()) {}

std::size_t AppearanceLookup::operator()(std::span<const Surface> surfaces,
                                         std::span<Appearance> found) {
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const Material& material = scene_.materials[surfaces[i].material];
    found[i].roughness = material.roughness;
    if (const auto* constant = std::get_if<glm::vec3>(&material.color)) {
      found[i].color = *constant;
    } else if (const auto* image = std::get_if<ImageColor>(&material.color)) {
      found[i].color = clamp_albedo(lookup_image(scene_.images[image->image], surfaces[i].uv));
    } else {
      waiting_[surfaces[i].material].push_back(static_cast<std::uint32_t>(i));
    }
  }
  std::size_t point_count = 0;
  for (std::size_t material = 0; material < waiting_.size(); ++material) {
    auto& which = waiting_[material];
    if (which.empty()) continue;
    query(scene_.materials[material], which, surfaces, found);
    point_count += which.size();
    which.clear();
  }
  return point_count;
}

// In texels. What is far smaller than a texel is a point, which is cheaper to look up.
float AppearanceLookup::filter_radius(float footprint) const {
  return filter_ == TextureFilter::none || footprint < kLeastRadius ? 0 : footprint;
}

void AppearanceLookup::query(const Material& material, std::span<const std::uint32_t> which,
                             std::span<const Surface> surfaces, std::span<Appearance> found) {
  const auto& color = std::get<SolidColor>(material.color);
  const solidtex::texture& texture = scene_.textures[color.texture];
  // The translation stays in double precision: textures may be looked up far from their origin.
  const glm::dvec3 origin(color.to_texels[3]);
  const glm::dmat3 linear(color.to_texels);
  const double scale = std::cbrt(std::abs(glm::determinant(linear)));
  points_.clear();
  radii_.clear();
  for (const std::uint32_t i : which) {
    const Surface& surface = surfaces[i];
    const glm::vec3& p = color.world_space ? surface.position : surface.object_position;
    const double units = color.world_space ? 1.0 : surface.object_scale;
    const float radius = filter_radius(static_cast<float>(surface.footprint * units * scale));
    glm::vec3 texels(linear * glm::dvec3(p));
    if (filter_ == TextureFilter::stochastic) texels += radius * surface.jitter;
    points_.insert(points_.end(), {texels.x, texels.y, texels.z});
    radii_.push_back(radius);
  }
  const std::size_t channel_count = texture.channel_count();
  values_.resize(which.size() * channel_count);
  if (filter_ == TextureFilter::footprint) {
    texture.eval_filtered({origin.x, origin.y, origin.z}, points_, radii_, values_);
  } else {
    texture.eval_points({origin.x, origin.y, origin.z}, points_, values_);
  }

  const glm::uvec3 channel = albedo_channels(texture);
  const bool encoded = texture.color_space() == "srgb";
  for (std::size_t k = 0; k < which.size(); ++k) {
    const float* value = &values_[k * channel_count];
    const glm::vec3 albedo =
        glm::clamp(glm::vec3(value[channel.x], value[channel.y], value[channel.z]), 0.0f, 1.0f);
    found[which[k]].color = clamp_albedo(encoded ? srgb_to_linear(albedo) : albedo);
  }
  if (material.roughness_channel.empty()) return;
  const std::size_t roughness = channel_index(texture, material.roughness_channel);
  for (std::size_t k = 0; k < which.size(); ++k) {
    found[which[k]].roughness = values_[k * channel_count + roughness];
  }
}

}  // namespace solidtex::pathtracer
