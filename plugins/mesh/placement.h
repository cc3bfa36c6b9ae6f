// Placement of a mesh in a solid texture.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "plugins/mesh/mesh.h"

namespace solidtex::mesh {

// A point p relative to the mesh's origin is looked up at origin + texels_per_unit * p, in texels.
struct Placement {
  std::array<double, 3> origin{};
  double texels_per_unit = 1;
};

// Default number of texels along the longest side of a mesh: enough to show the material.
inline constexpr double kDefaultExtent = 512;

// Default height of a relief, in texels, where the height channel is 1 instead of 0.
inline constexpr double kDefaultRelief = 1.5;

// Longest side of the bounding box. Throws MeshError if the mesh is a single point.
double longest_side(const Mesh& mesh);

// Places the zero of the mesh's coordinates at `origin`, in texels. Without texels_per_unit the
// longest side of the bounding box has kDefaultExtent texels; throws MeshError if the mesh is then
// a single point.
Placement place(const Mesh& mesh, const std::array<std::int64_t, 3>& origin,
                std::optional<double> texels_per_unit);

}  // namespace solidtex::mesh
