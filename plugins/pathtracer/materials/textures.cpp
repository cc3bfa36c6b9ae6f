#include "plugins/pathtracer/materials/textures.h"

#include <cmath>
#include <string>

#include "plugins/pathtracer/scene/color.h"

namespace solidtex::pathtracer {

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

Albedo::Albedo(const solidtex::texture& texture)
    : channels_(albedo_channels(texture)), is_encoded_(texture.color_space() == "srgb") {}

glm::vec3 Albedo::operator()(const float* value) const {
  const glm::vec3 albedo(value[channels_.x], value[channels_.y], value[channels_.z]);
  const glm::vec3 clamped = glm::clamp(albedo, 0.0f, 1.0f);
  return is_encoded_ ? srgb_to_linear(clamped) : clamped;
}

BrickStatistics brick_statistics(const Scene& scene) {
  BrickStatistics total;
  for (const solidtex::texture& texture : scene.textures) {
    const solidtex_statistics stats = texture.statistics();
    total.needed += stats.brick_count;
    total.computed += stats.miss_count;
    total.peak_bytes += stats.peak_bytes;
  }
  return total;
}

}  // namespace solidtex::pathtracer
