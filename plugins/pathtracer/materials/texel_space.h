// Where surface points are in a solid texture.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

#include "plugins/pathtracer/geometry/embree_scene.h"
#include "plugins/pathtracer/scene/scene.h"

namespace solidtex::pathtracer {

class TexelSpace {
 public:
  struct Point {
    glm::vec3 offset{0};  // from the origin
    float radius = 0;     // of the footprint
  };

  explicit TexelSpace(const SolidColor& color);

  // In double precision: textures may be looked up far from their origin.
  const glm::dvec3& origin() const { return origin_; }
  Point operator()(const Surface& surface) const;

 private:
  bool world_space_;
  glm::dmat3 linear_;
  glm::dvec3 origin_;
  double scale_;  // texels in one unit
};

// Half the edges of what the cone of a surface's ray sees of it, in texels; the first one, in the
// direction of the ray, is the longer one. `scene_to_texels`: of directions.
std::array<glm::vec3, 2> footprint_axes(const Surface& surface, const glm::mat3& scene_to_texels);

// The solid texture that a material asks, or null: that of its color, or that of its channels.
const SolidColor* solid_texture_of(const Material& material);

// How many of its points a surface with this material takes: with a bump those around it, too.
std::uint32_t texture_points_of(const Material& material);

}  // namespace solidtex::pathtracer
