// Where a mesh lies in a solid texture.
#pragma once

#include <array>

#include "plugins/mesh/mesh.h"

namespace solidtex::mesh {

// A point p of the mesh is looked up at origin + texels_per_unit * p, in texels.
struct Placement {
  std::array<double, 3> origin{};
  double texels_per_unit = 1;
};

// Texels along the longest side of a mesh that nobody has placed: enough to see the material.
inline constexpr double kDefaultExtent = 512;

// That many texels for the longest side of the mesh's box. Throws MeshError for a mesh that is a
// single point.
double default_texels_per_unit(const Mesh& mesh);

}  // namespace solidtex::mesh
