// Evaluates materials at surface interactions, in batches, so that a solid texture gets one query
// for many points.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "plugins/pathtracer/geometry/interaction.h"
#include "plugins/pathtracer/materials/textures.h"
#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

// Texture albedo is clamped below one, so that every path ends.
inline constexpr float kMaxTextureAlbedo = 0.999f;

// Inputs of a material evaluated at one point, not clamped.
struct MaterialSample {
  glm::vec3 color{0};
  float roughness = 0;
  float metallic = 0, specular = 1, coat = 0, coat_roughness = 0;
  glm::vec2 height_gradient{0};      // of the bump, along x and y of the shading normal's frame
  std::uint32_t texture_points = 0;  // evaluated for this sample
};

// Returns the normal of a surface whose height has this gradient along x and y of the frame of
// `normal`. Bends it back if it faces away from the viewer. All vectors have unit length.
glm::vec3 bumped_normal(const glm::vec3& normal, const glm::vec2& height_gradient,
                        const glm::vec3& view);

class MaterialEvaluator {
 public:
  // Keeps a reference to `scene`.
  MaterialEvaluator(const Scene& scene, TextureFilter filter);

  // Sets samples[i] to the material of interactions[i]. Makes one engine query per solid material,
  // for all channels it needs, a mix one per texture; a bump takes five points. Returns the number
  // of engine points.
  std::size_t operator()(std::span<const SurfaceInteraction> interactions,
                         std::span<MaterialSample> samples);

 private:
  // Inputs of a material by kind: constants, images, channels of a solid texture.
  struct Source {
    // `origin`: of the positions at which the solid texture is evaluated.
    Source(const Scene& scene, const Material& material, const glm::dvec3& origin);

    MaterialSample constant;
    const ColorImage* color_image = nullptr;
    std::vector<std::pair<float MaterialSample::*, ImageChannel>> images;
    const SolidColor* solid = nullptr;
    const solidtex::texture* texture = nullptr;
    std::optional<Albedo> albedo;  // none if the solid texture gives channels only
    std::vector<std::pair<float MaterialSample::*, std::size_t>> channels;
    std::optional<Bump> bump;
    glm::dvec3 origin;
    std::vector<std::uint32_t> pending;  // interactions of the current batch
  };

  void look_up_images(const Source& source, const SurfaceInteraction& interaction,
                      MaterialSample& sample) const;
  void query(const Source& source, std::span<const SurfaceInteraction> interactions,
             std::span<MaterialSample> samples);
  void query_mix(const Source& source, std::span<const SurfaceInteraction> interactions,
                 std::span<MaterialSample> samples);
  void evaluate(const Source& source, const solidtex::texture& texture,
                std::span<const std::uint32_t> indices,
                std::span<const SurfaceInteraction> interactions);
  void place_points(const Source& source, std::span<const std::uint32_t> indices,
                    std::span<const SurfaceInteraction> interactions);
  void place_neighbors(const SurfaceInteraction& interaction, const glm::vec3& texels,
                       float radius);
  void append_axes(const Source& source, const SurfaceInteraction& interaction);
  float filter_radius(float footprint) const;

  Source& source_of(const SurfaceInteraction& interaction);

  const Scene& scene_;
  TextureFilter filter_;
  std::vector<Source> sources_;  // per material, then per object with an origin of its own
  std::vector<std::uint32_t> object_sources_;  // per object; empty if all use their material's
  // Arguments and result of a query, kept to save allocations.
  std::vector<float> points_, radii_, values_;
  std::vector<float> axes_;              // of anisotropic footprints
  std::vector<float> steps_;             // to a bump's neighbors, in world units
  std::vector<float> places_;            // of a mix's points on its walk
  std::vector<std::uint32_t> selected_;  // of them, those that one texture of the mix needs
  // Per object: maps directions from world space to texels, for bumps and footprint axes. Empty if
  // no object needs it.
  std::vector<glm::mat3> world_to_texels_;
};

}  // namespace solidtex::pathtracer
