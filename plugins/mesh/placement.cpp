#include "plugins/mesh/placement.h"

#include <algorithm>

namespace solidtex::mesh {

Box bounding_box(const Mesh& mesh) {
  Box box{glm::dvec3(mesh.positions.front()), glm::dvec3(mesh.positions.front())};
  for (const glm::vec3& p : mesh.positions) {
    box.low = glm::min(box.low, glm::dvec3(p));
    box.high = glm::max(box.high, glm::dvec3(p));
  }
  return {box.low + mesh.origin, box.high + mesh.origin};
}

double longest_side(const Mesh& mesh) {
  const double longest = bounding_box(mesh).longest_side();
  if (!(longest > 0)) {
    throw MeshError(mesh.file + ": found all vertices at one point, expected a surface");
  }
  return longest;
}

Placement place(const Mesh& mesh, const std::array<std::int64_t, 3>& origin,
                std::optional<double> texels_per_unit) {
  Placement placement;
  std::ranges::transform(origin, placement.origin.begin(),
                         [](std::int64_t texel) { return static_cast<double>(texel); });
  placement.texels_per_unit =
      texels_per_unit ? *texels_per_unit : kDefaultExtent / longest_side(mesh);
  for (int axis = 0; axis < 3; ++axis) {
    placement.origin[static_cast<std::size_t>(axis)] +=
        placement.texels_per_unit * mesh.origin[axis];
  }
  return placement;
}

}  // namespace solidtex::mesh
