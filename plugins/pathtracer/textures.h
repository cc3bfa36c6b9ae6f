// Colours of many surface points at once, so that solid textures are asked in batches.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "plugins/pathtracer/embree_scene.h"
#include "plugins/pathtracer/scene.h"

namespace solidtex::pathtracer {

// Albedo of textures is kept below one, so that every light path ends.
inline constexpr float kMaxTextureAlbedo = 0.999f;

glm::vec3 srgb_to_linear(const glm::vec3& encoded);
glm::vec3 linear_to_srgb(const glm::vec3& linear);

// Bilinear, repeating; v = 0 is the bottom row's lower edge.
glm::vec3 lookup_image(const ColorImage& image, const glm::vec2& uv);

// Indices of a texture's albedo.r, albedo.g, albedo.b. Throws SceneError when it lacks one.
glm::uvec3 albedo_channels(const solidtex::texture& texture);

class ColorLookup {
 public:
  explicit ColorLookup(const Scene& scene);

  // colors[i] becomes the colour of surfaces[i]. One engine query per solid material. Returns the
  // number of points that engine queries were asked for.
  std::size_t operator()(std::span<const Surface> surfaces, std::span<glm::vec3> colors);

 private:
  void query(const SolidColor& color, std::span<const std::uint32_t> which,
             std::span<const Surface> surfaces, std::span<glm::vec3> colors);

  const Scene& scene_;
  std::vector<std::vector<std::uint32_t>> waiting_;  // per material: surfaces to ask for
  std::vector<float> points_, values_;               // kept to save allocations
};

}  // namespace solidtex::pathtracer
