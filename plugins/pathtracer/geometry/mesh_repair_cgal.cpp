// Mesh repair by CGAL. Only this file and mesh_cut_cgal.cpp include CGAL (GPL). Their calls are the
// same in CGAL 5.5 and 6; CMakeLists.txt checks the version.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Surface_mesh.h>

#include <cstdint>
#include <utility>

#include "plugins/pathtracer/geometry/mesh.h"

namespace solidtex::pathtracer {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;
using SurfaceMesh = CGAL::Surface_mesh<Point>;

// A face of the soup and the mesh triangle that it was. CGAL merges vertices of equal position,
// which UV seams and creases split, and reorders faces.
struct Face : std::vector<std::size_t> {
  using std::vector<std::size_t>::vector;
  std::size_t source = 0;
};

struct Soup {
  std::vector<Point> points;
  std::vector<Face> faces;
};

Point to_cgal(const glm::vec3& p) { return {p.x, p.y, p.z}; }

Soup make_soup(const Mesh& mesh) {
  Soup soup;
  for (const glm::vec3& p : mesh.positions) soup.points.push_back(to_cgal(p));
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const glm::uvec3& t = mesh.triangles[i];
    Face face{t.x, t.y, t.z};
    face.source = i;
    soup.faces.push_back(std::move(face));
  }
  return soup;
}

// Whether the orientation of a face differs from that of its source triangle.
bool is_flipped(const Mesh& mesh, const Soup& soup, const Face& face) {
  const glm::uvec3& t = mesh.triangles[face.source];
  const Point corners[] = {to_cgal(mesh.positions[t.x]), to_cgal(mesh.positions[t.y]),
                           to_cgal(mesh.positions[t.z])};
  std::size_t first = 0;
  while (corners[first] != soup.points[face[0]]) ++first;
  return corners[(first + 1) % 3] != soup.points[face[1]];
}

SurfaceMesh to_surface_mesh(const Soup& soup) {
  SurfaceMesh surface;
  pmp::polygon_soup_to_polygon_mesh(soup.points, soup.faces, surface);
  return surface;
}

// Orients the faces of closed components outward. Faces of `surface` are in the soup's order.
void orient_outward(Soup& soup, SurfaceMesh& surface) {
  const SurfaceMesh before = surface;
  pmp::orient(surface);
  for (std::size_t i = 0; i < soup.faces.size(); ++i) {
    const SurfaceMesh::Face_index face(static_cast<SurfaceMesh::size_type>(i));
    const auto halfedge = before.halfedge(face);
    const auto target = before.target(halfedge);
    // The face was reversed if its former halfedge is now on the other side.
    const auto reversed = surface.halfedge(before.source(halfedge), target);
    if (surface.face(reversed) != face) std::swap(soup.faces[i][1], soup.faces[i][2]);
  }
}

}  // namespace

bool can_repair_meshes() { return true; }

MeshReport repair_mesh(Mesh& mesh) {
  Soup soup = make_soup(mesh);
  pmp::repair_polygon_soup(soup.points, soup.faces);
  MeshReport report;
  report.removed_faces = mesh.triangles.size() - soup.faces.size();
  if (soup.faces.empty()) {
    mesh.triangles.clear();
    return report;
  }
  pmp::orient_polygon_soup(soup.points, soup.faces);

  SurfaceMesh surface = to_surface_mesh(soup);
  std::vector<SurfaceMesh::Halfedge_index> holes;
  pmp::extract_boundary_cycles(surface, std::back_inserter(holes));
  report.hole_count = holes.size();
  report.closed = holes.empty();
  auto components = surface.add_property_map<SurfaceMesh::Face_index, std::size_t>("f:part").first;
  report.component_count = pmp::connected_components(surface, components);
  if (report.closed) orient_outward(soup, surface);

  std::vector<glm::uvec3> triangles;
  for (const Face& face : soup.faces) {
    glm::uvec3 triangle = mesh.triangles[face.source];
    if (is_flipped(mesh, soup, face)) {
      std::swap(triangle.y, triangle.z);
      ++report.flipped_faces;
    }
    triangles.push_back(triangle);
  }
  mesh.triangles = std::move(triangles);
  return report;
}

}  // namespace solidtex::pathtracer
