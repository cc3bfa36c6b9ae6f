// One triangle of a mesh on its atlas.
#pragma once

#include <optional>

#include "plugins/mesh/placement.h"

namespace solidtex::mesh {

// In double precision, from the mesh alone, so that every region sees the same.
class UvTriangle {
 public:
  // None for a triangle whose area in the atlas is zero.
  static std::optional<UvTriangle> of(const Mesh& mesh, std::size_t triangle, int size);

  // Its box in texels.
  const glm::dvec2& low() const { return low_; }
  const glm::dvec2& high() const { return high_; }

  // The least of the weights of the three corners at a point in texels: 0 or more inside.
  double inside(const glm::dvec2& texel) const;

  // The point of the mesh at a point in texels, and how it moves for one texel to the right and
  // one down.
  glm::dvec3 position(const glm::dvec2& texel) const {
    return corner_ + right_ * (texel.x - at_.x) + down_ * (texel.y - at_.y);
  }
  const glm::dvec3& right() const { return right_; }
  const glm::dvec3& down() const { return down_; }

 private:
  glm::dvec2 at_, low_, high_;        // where the first corner lies; texels
  glm::dvec2 second_, third_;         // by how much a texel right and down weighs them more
  glm::dvec3 corner_, right_, down_;  // in the mesh's units
};

}  // namespace solidtex::mesh
