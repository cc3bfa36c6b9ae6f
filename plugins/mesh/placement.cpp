#include "plugins/mesh/placement.h"

#include <algorithm>

namespace solidtex::mesh {

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

}  // namespace solidtex::mesh
