// Repair and cuts of meshes.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "plugins/mesh/mesh.h"

namespace solidtex::pathtracer {

using mesh::load_mesh;
using mesh::Mesh;

// Result of repair_mesh.
struct MeshReport {
  std::size_t removed_faces = 0;  // degenerate or duplicate
  std::size_t flipped_faces = 0;
  std::size_t component_count = 0, hole_count = 0;
  bool closed = false;
};

// Whether this build has CGAL. Without it repair_mesh does nothing.
bool can_repair_meshes();

// Removes duplicate and degenerate faces. Orients the faces of each component consistently, outward
// if the mesh is closed. Keeps vertices and their attributes.
MeshReport repair_mesh(Mesh& mesh);

// Describes the mesh and its repair in one line.
std::string describe(const Mesh& mesh, const MeshReport& report);

// Applied to a solid A: the difference A \ tool, or the intersection of A and the tool.
struct Cut {
  enum class Operation { subtract, intersect };
  Operation operation = Operation::subtract;
  Mesh tool;  // a closed surface, in the coordinates of the mesh to cut
};

// Applies the cuts in order, with exact arithmetic until the last one. Remaining faces keep their
// normals and texture coordinates. Cut faces get the tool's normals, reversed where it was
// subtracted, and zero texture coordinates if the mesh has any. Throws SceneError, naming the
// invalid mesh, if it is open or intersects itself, if the result is empty or touches itself, and
// in a build without CGAL.
Mesh cut_mesh(const Mesh& mesh, const std::vector<Cut>& cuts);

// Tools around the origin. A sphere has smooth normals, a box has flat faces.
Mesh make_box(const glm::vec3& size);
Mesh make_sphere(float radius);

// The half-space in front of a plane, as a box that is large enough for `mesh`.
Mesh make_half_space(const glm::vec3& point, const glm::vec3& normal, const Mesh& mesh);

// Rewrites a transform for positions that are relative to the origins `from` and `to`.
glm::dmat4 between_origins(glm::dmat4 transform, const glm::dvec3& from, const glm::dvec3& to);

// Transforms a mesh, whose positions become relative to `origin`. Reverses its faces if the
// transform mirrors, so that they still face outward.
void transform_mesh(Mesh& mesh, const glm::dmat4& transform, const glm::dvec3& origin = {});

}  // namespace solidtex::pathtracer
