// Colour and roughness of many surface points at once, so that solid textures are asked in batches.
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

// Index of a texture's channel. Throws SceneError, which names all channels, when there is none.
std::size_t channel_index(const solidtex::texture& texture, const std::string& name);
glm::uvec3 albedo_channels(const solidtex::texture& texture);  // albedo.r, albedo.g, albedo.b

// What a material is at one point.
struct Appearance {
  glm::vec3 color{0};
  float roughness = 0;  // of the coat
};

class AppearanceLookup {
 public:
  AppearanceLookup(const Scene& scene, TextureFilter filter);

  // found[i] becomes the appearance of surfaces[i]. One engine query per solid material. Returns
  // the number of points that engine queries were asked for.
  std::size_t operator()(std::span<const Surface> surfaces, std::span<Appearance> found);

 private:
  float filter_radius(float footprint) const;
  void query(const Material& material, std::span<const std::uint32_t> which,
             std::span<const Surface> surfaces, std::span<Appearance> found);

  const Scene& scene_;
  TextureFilter filter_;
  std::vector<std::vector<std::uint32_t>> waiting_;  // per material: surfaces to ask for
  std::vector<float> points_, radii_, values_;       // kept to save allocations
};

}  // namespace solidtex::pathtracer
