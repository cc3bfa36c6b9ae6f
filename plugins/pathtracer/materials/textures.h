// Images, channels of solid textures, encodings of colours.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <string>

#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

glm::vec3 srgb_to_linear(const glm::vec3& encoded);
glm::vec3 linear_to_srgb(const glm::vec3& linear);

// Bilinear, repeating; v = 0 is the bottom row's lower edge.
glm::vec3 lookup_image(const ColorImage& image, const glm::vec2& uv);

// Index of a texture's channel. Throws SceneError, which names all channels, when there is none.
std::size_t channel_index(const solidtex::texture& texture, const std::string& name);
glm::uvec3 albedo_channels(const solidtex::texture& texture);  // albedo.r, albedo.g, albedo.b

}  // namespace solidtex::pathtracer
