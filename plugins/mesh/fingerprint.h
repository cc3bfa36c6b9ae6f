// Hash of a mesh, for checkpoints.
#pragma once

#include "plugins/common/fingerprint.h"
#include "plugins/mesh/mesh.h"

namespace solidtex::mesh {

inline void add(Fingerprint& fingerprint, const Mesh& mesh) {
  fingerprint.add(mesh.positions);
  fingerprint.add(mesh.normals);
  fingerprint.add(mesh.uvs);
  fingerprint.add(mesh.triangles);
  if (!mesh.attribute.empty()) fingerprint.add(mesh.attribute);
  if (mesh.origin != glm::dvec3(0)) fingerprint.add(&mesh.origin, sizeof mesh.origin);
}

}  // namespace solidtex::mesh
