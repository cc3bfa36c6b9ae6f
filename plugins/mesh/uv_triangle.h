// Triangle of a mesh in its atlas.
#pragma once

#include <optional>

#include "plugins/mesh/placement.h"

namespace solidtex::mesh {

// Computed in double precision from the mesh alone, so that every region has the same bits.
class UvTriangle {
 public:
  // Returns nothing for a triangle with zero area in the atlas.
  static std::optional<UvTriangle> of(const Mesh& mesh, std::size_t triangle, int size);

  // Bounding box in texels.
  const glm::dvec2& low() const { return low_; }
  const glm::dvec2& high() const { return high_; }

  // Smallest barycentric coordinate of a point in texels: 0 or more inside.
  double inside(const glm::dvec2& texel) const;

  // Position on the mesh of a point in texels, and its derivatives by texels to the right and down.
  glm::dvec3 position(const glm::dvec2& texel) const {
    return corner_ + right_ * (texel.x - at_.x) + down_ * (texel.y - at_.y);
  }
  const glm::dvec3& right() const { return right_; }
  const glm::dvec3& down() const { return down_; }

 private:
  glm::dvec2 at_, low_, high_;        // first corner, bounding box; in texels
  glm::dvec2 second_, third_;         // derivatives of barycentric coordinates by texels
  glm::dvec3 corner_, right_, down_;  // in the mesh's units
};

}  // namespace solidtex::mesh
