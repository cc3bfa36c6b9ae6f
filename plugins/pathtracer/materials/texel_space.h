// Maps surface interactions to the texel space of a solid texture.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

#include "plugins/pathtracer/geometry/interaction.h"
#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

class TexelSpace {
 public:
  struct Point {
    glm::vec3 offset{0};  // from the origin
    float radius = 0;     // of the footprint
  };

  // `origin`: of the positions that are mapped.
  explicit TexelSpace(const SolidColor& color, const glm::dvec3& origin = {});

  // In double precision: textures may be evaluated far from their origin.
  const glm::dvec3& origin() const { return origin_; }
  Point operator()(const SurfaceInteraction& interaction) const;

 private:
  bool world_space_;
  glm::dmat3 linear_;
  glm::dvec3 origin_;
  double scale_;  // texels per unit
};

// Returns the origin of the positions at which an object's solid texture is evaluated.
glm::dvec3 position_origin(const Scene& scene, const SolidColor& color, std::uint32_t object);

// Returns half the edges of the footprint of the ray's cone on the surface, in texels. The first
// edge, along the ray, is the longer one. `world_to_texels` maps directions.
std::array<glm::vec3, 2> footprint_axes(const SurfaceInteraction& interaction,
                                        const glm::mat3& world_to_texels);

// Returns the solid texture of a material's color, else that of its channels, else null.
const SolidColor* solid_texture_of(const Material& material);

SolidColor* solid_texture_of(Material& material);

}  // namespace solidtex::pathtracer
