#include <filesystem>

#include "plugins/pathtracer/geometry/mesh.h"

namespace solidtex::pathtracer {

std::string describe(const Mesh& mesh, const MeshReport& report) {
  std::string text = std::filesystem::path(mesh.file).filename().string() + ": " +
                     std::to_string(mesh.triangles.size()) + " triangles";
  if (!can_repair_meshes()) return text + " (not checked: built without CGAL)";
  text += ", " + std::to_string(report.component_count) +
          (report.component_count == 1 ? " part" : " parts");
  text += report.closed ? ", closed"
                        : ", open with " + std::to_string(report.hole_count) +
                              (report.hole_count == 1 ? " hole" : " holes");
  if (report.removed_faces > 0) {
    text += "; removed " + std::to_string(report.removed_faces) + " duplicate or degenerate faces";
  }
  if (report.flipped_faces > 0) {
    text += "; turned over " + std::to_string(report.flipped_faces) + " faces";
  }
  return text;
}

}  // namespace solidtex::pathtracer
