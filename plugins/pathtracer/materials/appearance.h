// What materials are at many surface points at once, so that solid textures are asked in batches.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "plugins/pathtracer/geometry/embree_scene.h"
#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

// Albedo of textures is kept below one, so that every light path ends.
inline constexpr float kMaxTextureAlbedo = 0.999f;

// What a material is at one point. Shares are as found, in [0, 1] or not.
struct Appearance {
  glm::vec3 color{0};
  float roughness = 0;
  float metallic = 0, specular = 1, coat = 0, coat_roughness = 0;
  glm::vec2 slope{0};  // of the bump, along x and y of the frame of the surface's normal
};

// The normal of a surface that rises by `slope` along x and y of the frame of `normal`, turned back
// where it would look away from the viewer. All of unit length.
glm::vec3 bumped_normal(const glm::vec3& normal, const glm::vec2& slope, const glm::vec3& view);

class AppearanceLookup {
 public:
  // Keeps a reference to `scene`.
  AppearanceLookup(const Scene& scene, TextureFilter filter);

  // found[i] becomes the appearance of surfaces[i]. One engine query per solid material, which
  // gives all the channels that it takes, at five points for one with a bump. Returns the number of
  // points that the engine was asked.
  std::size_t operator()(std::span<const Surface> surfaces, std::span<Appearance> found);

 private:
  // Where a material's appearance comes from.
  struct Source {
    Source(const Scene& scene, const Material& material);

    Appearance constant;
    const ColorImage* color_image = nullptr;
    std::vector<std::pair<float Appearance::*, ImageChannel>> images;
    const SolidColor* solid = nullptr;
    const solidtex::texture* texture = nullptr;
    bool solid_color = false, encoded = false;
    glm::uvec3 albedo{0};  // channels
    std::vector<std::pair<float Appearance::*, std::size_t>> channels;
    std::optional<Bump> bump;
    std::vector<std::uint32_t> waiting;  // surfaces to ask for
  };

  void look_up_images(const Source& source, const Surface& surface, Appearance& found) const;
  void query(const Source& source, std::span<const Surface> surfaces, std::span<Appearance> found);
  void place_points(const Source& source, std::span<const Surface> surfaces);
  void place_neighbours(const Surface& surface, const glm::vec3& texels, float radius);
  void append_axes(const Source& source, const Surface& surface);
  float filter_radius(float footprint) const;

  const Scene& scene_;
  TextureFilter filter_;
  std::vector<Source> sources_;                 // per material
  std::vector<float> points_, radii_, values_;  // kept to save allocations
  std::vector<float> axes_;                     // the same, where the filter takes them
  std::vector<float> steps_;                    // to a bump's neighbours, in the scene's units
  // Per object that needs it, for its bump or its axes: from directions in the scene to texels.
  // Empty where none does.
  std::vector<glm::mat3> scene_to_texels_;
};

}  // namespace solidtex::pathtracer
