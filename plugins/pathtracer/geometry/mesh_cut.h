// Cutting solids: what is left of a mesh after others are taken away, with the cut faces closed.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "plugins/pathtracer/geometry/mesh.h"

namespace solidtex::pathtracer {

// Applied to a solid A: A \ tool, or the common part of A and the tool.
struct Cut {
  enum class Operation { subtract, intersect };
  Operation operation = Operation::subtract;
  Mesh tool;  // a closed surface, in the coordinates of the mesh that is cut
};

// Applies the cuts in order, with exact arithmetic until the end. Faces that are left keep their
// normals and texture coordinates; cut faces have the tool's normals, turned over where it was
// subtracted, and no texture coordinates (zeros, where the mesh has some). Throws SceneError,
// naming the mesh that is at fault, for one that is open or intersects itself, for a result that is
// empty or touches itself, and in a build without CGAL.
Mesh cut_mesh(const Mesh& mesh, const std::vector<Cut>& cuts);

// Tools, around the origin. A sphere has smooth normals, a box has flat faces.
Mesh make_box(const glm::vec3& size);
Mesh make_sphere(float radius);

// The half-space in front of a plane, as far as `mesh` can reach: a box.
Mesh make_half_space(const glm::vec3& point, const glm::vec3& normal, const Mesh& mesh);

// Moves a tool. Turns its faces over where the map mirrors space, so that they still look outward.
void transform_mesh(Mesh& mesh, const glm::dmat4& map);

}  // namespace solidtex::pathtracer
