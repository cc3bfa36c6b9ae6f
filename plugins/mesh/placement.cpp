#include "plugins/mesh/placement.h"

#include <algorithm>

namespace solidtex::mesh {
namespace {

double default_texels_per_unit(const Mesh& mesh) {
  glm::dvec3 low(mesh.positions.front()), high = low;
  for (const glm::vec3& p : mesh.positions) {
    low = glm::min(low, glm::dvec3(p));
    high = glm::max(high, glm::dvec3(p));
  }
  const glm::dvec3 size = high - low;
  const double longest = std::max({size.x, size.y, size.z});
  if (!(longest > 0)) {
    throw MeshError(mesh.file + ": found all vertices at one point, expected a surface");
  }
  return kDefaultExtent / longest;
}

}  // namespace

Placement place(const Mesh& mesh, const std::array<std::int64_t, 3>& origin,
                std::optional<double> texels_per_unit) {
  Placement placement;
  std::ranges::transform(origin, placement.origin.begin(),
                         [](std::int64_t texel) { return static_cast<double>(texel); });
  placement.texels_per_unit = texels_per_unit ? *texels_per_unit : default_texels_per_unit(mesh);
  for (int axis = 0; axis < 3; ++axis) {
    placement.origin[static_cast<std::size_t>(axis)] +=
        placement.texels_per_unit * mesh.origin[axis];
  }
  return placement;
}

}  // namespace solidtex::mesh
