// Cuts by corefinement (CGAL, GPL). Coordinates are exact until the last cut, so that rounding of
// one cut cannot make the next one fail.
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <array>
#include <cstdint>
#include <map>
#include <tuple>
#include <utility>

#include "plugins/pathtracer/geometry/mesh.h"
#include "solidtex/pathtracer.hpp"

namespace solidtex::pathtracer {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Point = Kernel::Point_3;
using SurfaceMesh = CGAL::Surface_mesh<Point>;
using FaceIndex = SurfaceMesh::Face_index;

// The triangle that a face is a piece of: of the mesh (0) or of a tool (1 + its index).
struct Source {
  std::uint32_t mesh = 0, triangle = 0;
};
using SourceMap = SurfaceMesh::Property_map<FaceIndex, Source>;

SourceMap source_map(SurfaceMesh& surface) {
  return surface.add_property_map<FaceIndex, Source>("f:source").first;
}

// Copies each face's source to the faces that it is split into or copied to.
class SourceVisitor : public pmp::Corefinement::Default_visitor<SurfaceMesh> {
 public:
  SourceVisitor(SurfaceMesh& first, SurfaceMesh& second)
      : maps_{{&first, source_map(first)}, {&second, source_map(second)}} {}

  void before_subface_creations(FaceIndex split, const SurfaceMesh& surface) {
    current_ = map(surface)[split];
  }
  void after_subface_created(FaceIndex part, const SurfaceMesh& surface) {
    map(surface)[part] = current_;
  }
  void after_face_copy(FaceIndex from, const SurfaceMesh& surface, FaceIndex to,
                       const SurfaceMesh& target) {
    map(target)[to] = map(surface)[from];
  }

 private:
  SourceMap& map(const SurfaceMesh& surface) { return maps_.at(&surface); }

  std::map<const SurfaceMesh*, SourceMap> maps_;
  Source current_;
};

[[noreturn]] void refuse(const std::string& name, const std::string& found,
                         const std::string& expected) {
  throw SceneError(name + ": found " + found + ", expected " + expected);
}

// Returns a closed surface with the source of each face.
SurfaceMesh to_solid(const Mesh& mesh, std::uint32_t number) {
  struct Face : std::vector<std::size_t> {
    using std::vector<std::size_t>::vector;
    std::uint32_t triangle = 0;
  };
  std::vector<Point> points;
  std::vector<Face> faces;
  for (const glm::vec3& p : mesh.positions) points.emplace_back(p.x, p.y, p.z);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const glm::uvec3& t = mesh.triangles[i];
    faces.push_back({t.x, t.y, t.z});
    faces.back().triangle = static_cast<std::uint32_t>(i);
  }
  pmp::repair_polygon_soup(points, faces);  // merges vertices that seams split
  SurfaceMesh surface;
  if (!pmp::is_polygon_soup_a_polygon_mesh(faces)) {
    refuse(mesh.file, "edges with more than two faces, or parts that meet in one vertex",
           "a solid's surface, because it is cut: unite its parts, or move them apart");
  }
  pmp::polygon_soup_to_polygon_mesh(points, faces, surface);
  if (!CGAL::is_closed(surface)) {
    refuse(mesh.file, "an open surface", "a closed one, because it is cut: fill its holes");
  }
  if (pmp::does_self_intersect(surface)) {
    refuse(mesh.file, "a surface that intersects itself",
           "a solid's surface, because it is cut: unite its parts, or move them apart");
  }
  if (!pmp::is_outward_oriented(surface)) pmp::reverse_face_orientations(surface);
  SourceMap sources = source_map(surface);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const FaceIndex face(static_cast<SurfaceMesh::size_type>(i));
    sources[face] = {number, faces[i].triangle};
  }
  return surface;
}

void apply(SurfaceMesh& solid, SurfaceMesh& tool, const Cut& cut, const std::string& name) {
  const auto visitor = CGAL::parameters::visitor(SourceVisitor(solid, tool));
  const bool whole = cut.operation == Cut::Operation::subtract
                         ? pmp::corefine_and_compute_difference(solid, tool, solid, visitor)
                         : pmp::corefine_and_compute_intersection(solid, tool, solid, visitor);
  if (!whole) {
    refuse(name, "a result that touches itself along an edge after the cut by " + cut.tool.file,
           "a solid (move the tool, or change its size, a little)");
  }
  solid.collect_garbage();
  if (solid.number_of_faces() == 0) {
    refuse(name, "no faces left after the cut by " + cut.tool.file, "a visible remainder");
  }
}

glm::vec3 to_glm(const Point& p) {
  return {CGAL::to_double(p.x()), CGAL::to_double(p.y()), CGAL::to_double(p.z())};
}

// Barycentric coordinates of a point in a triangle's plane.
glm::vec3 barycentric(const std::array<glm::dvec3, 3>& corners, const glm::dvec3& p) {
  const glm::dvec3 normal = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
  const double area = glm::dot(normal, normal);
  const auto weight = [&](int a, int b) {
    return glm::dot(normal, glm::cross(corners[a] - p, corners[b] - p)) / area;
  };
  return glm::clamp(glm::vec3(weight(1, 2), weight(2, 0), weight(0, 1)), 0.0f, 1.0f);
}

// Converts faces back into a mesh. Faces share vertices where position, normal and UV agree.
class Assembler {
 public:
  Assembler(const Mesh& mesh, const std::vector<Cut>& cuts) : mesh_(mesh), cuts_(cuts) {
    result_.file = mesh.file;
    result_.origin = mesh.origin;
    result_.rounding_error = mesh.rounding_error;
    has_uvs_ = !mesh.uvs.empty();
    has_normals_ = !mesh.normals.empty();
    for (const Cut& cut : cuts) has_normals_ = has_normals_ || !cut.tool.normals.empty();
  }

  void add(const std::array<glm::vec3, 3>& corners, const Source& source) {
    // Skips faces that single precision makes degenerate: their neighbors then meet.
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) return;
    glm::uvec3 triangle;
    for (int i = 0; i < 3; ++i) triangle[i] = vertex(corners[i], source);
    result_.triangles.push_back(triangle);
  }

  Mesh take() { return std::move(result_); }

 private:
  unsigned vertex(const glm::vec3& position, const Source& source) {
    const bool is_cut = source.mesh > 0;
    const Mesh& from = is_cut ? cuts_[source.mesh - 1].tool : mesh_;
    const bool is_reversed = is_cut && cuts_[source.mesh - 1].operation == Cut::Operation::subtract;
    const glm::uvec3 t = from.triangles[source.triangle];
    const std::array<glm::dvec3, 3> corners = {from.positions[t.x], from.positions[t.y],
                                               from.positions[t.z]};
    const glm::vec3 weights = barycentric(corners, glm::dvec3(position));
    const auto mixed = [&](const auto& values) {
      return weights.x * values[t.x] + weights.y * values[t.y] + weights.z * values[t.z];
    };
    glm::dvec3 normal = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
    if (!from.normals.empty() && mixed(from.normals) != glm::vec3(0)) normal = mixed(from.normals);
    normal = glm::normalize(is_reversed ? -normal : normal);
    return shared(position, glm::vec3(normal),
                  is_cut || !has_uvs_ ? glm::vec2(0) : mixed(from.uvs));
  }

  unsigned shared(const glm::vec3& p, const glm::vec3& n, const glm::vec2& uv) {
    const auto key = std::make_tuple(p.x, p.y, p.z, n.x, n.y, n.z, uv.x, uv.y);
    const auto [entry, is_new] =
        known_.try_emplace(key, static_cast<unsigned>(result_.positions.size()));
    if (is_new) {
      result_.positions.push_back(p);
      if (has_normals_) result_.normals.push_back(n);
      if (has_uvs_) result_.uvs.push_back(uv);
    }
    return entry->second;
  }

  const Mesh& mesh_;
  const std::vector<Cut>& cuts_;
  Mesh result_;
  bool has_normals_ = false, has_uvs_ = false;
  std::map<std::tuple<float, float, float, float, float, float, float, float>, unsigned> known_;
};

}  // namespace

Mesh cut_mesh(const Mesh& mesh, const std::vector<Cut>& cuts) {
  SurfaceMesh solid = to_solid(mesh, 0);
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    SurfaceMesh tool = to_solid(cuts[i].tool, static_cast<std::uint32_t>(i + 1));
    apply(solid, tool, cuts[i], mesh.file);
  }
  const SourceMap sources = source_map(solid);
  Assembler assembler(mesh, cuts);
  for (const FaceIndex face : solid.faces()) {
    std::array<glm::vec3, 3> corners;
    auto halfedge = solid.halfedge(face);
    for (glm::vec3& corner : corners) {
      corner = to_glm(solid.point(solid.target(halfedge)));
      halfedge = solid.next(halfedge);
    }
    assembler.add(corners, sources[face]);
  }
  return assembler.take();
}

}  // namespace solidtex::pathtracer
