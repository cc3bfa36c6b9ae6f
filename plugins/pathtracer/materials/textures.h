// Look-ups of images, and channels of solid textures.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <string>

#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

// Bilinear, repeating. v = 0 is the lower edge of the bottom row.
glm::vec3 lookup_image(const ColorImage& image, const glm::vec2& uv);

// Returns the index of a channel. Throws SceneError, listing all channels, if there is none.
std::size_t channel_index(const solidtex::texture& texture, const std::string& name);
glm::uvec3 albedo_channels(const solidtex::texture& texture);  // albedo.r, albedo.g, albedo.b

// Linear albedo of a solid texture's value, from 0 to 1.
class Albedo {
 public:
  explicit Albedo(const solidtex::texture& texture);
  glm::vec3 operator()(const float* value) const;

 private:
  glm::uvec3 channels_;
  bool is_encoded_;
};

}  // namespace solidtex::pathtracer
