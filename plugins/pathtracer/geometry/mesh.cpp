#include "plugins/pathtracer/geometry/mesh.h"

#include <cmath>
#include <filesystem>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_inverse.hpp>
#include <glm/gtc/matrix_transform.hpp>

namespace solidtex::pathtracer {
namespace {

// Resolution of a sphere: with smooth normals no facet is visible.
constexpr unsigned kRings = 48, kFacets = 96;

struct Bounds {
  glm::dvec3 center{0};
  double radius = 0;
};

Bounds bounds_of(const Mesh& mesh) {
  glm::dvec3 lo(mesh.positions.front()), hi = lo;
  for (const glm::vec3& p : mesh.positions) {
    lo = glm::min(lo, glm::dvec3(p));
    hi = glm::max(hi, glm::dvec3(p));
  }
  return {0.5 * (lo + hi), 0.5 * glm::length(hi - lo)};
}

}  // namespace

std::string describe(const Mesh& mesh, const MeshReport& report) {
  std::string text = std::filesystem::path(mesh.file).filename().string() + ": " +
                     std::to_string(mesh.triangles.size()) +
                     (mesh.triangles.size() == 1 ? " triangle" : " triangles");
  if (!can_repair_meshes()) return text + " (not checked: built without CGAL)";
  text += ", " + std::to_string(report.component_count) +
          (report.component_count == 1 ? " component" : " components");
  text += report.closed ? ", closed"
                        : ", open with " + std::to_string(report.hole_count) +
                              (report.hole_count == 1 ? " hole" : " holes");
  if (report.removed_faces > 0) {
    text += "; removed " + std::to_string(report.removed_faces) + " duplicate or degenerate faces";
  }
  if (report.flipped_faces > 0) {
    text += "; reversed " + std::to_string(report.flipped_faces) + " faces";
  }
  return text;
}

Mesh make_box(const glm::vec3& size) {
  Mesh box;
  box.file = "box";
  for (unsigned i = 0; i < 8; ++i) {
    const glm::vec3 corner((i & 1) ? 0.5f : -0.5f, (i & 2) ? 0.5f : -0.5f, (i & 4) ? 0.5f : -0.5f);
    box.positions.push_back(corner * size);
  }
  const glm::uvec4 sides[] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                              {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const glm::uvec4& side : sides) {
    box.triangles.emplace_back(side.x, side.y, side.z);
    box.triangles.emplace_back(side.x, side.z, side.w);
  }
  return box;
}

Mesh make_sphere(float radius) {
  Mesh sphere;
  sphere.file = "sphere";
  const auto add = [&](const glm::vec3& normal) {
    sphere.positions.push_back(radius * normal);
    sphere.normals.push_back(normal);
  };
  add({0, 1, 0});
  for (unsigned ring = 1; ring < kRings; ++ring) {
    const double polar = glm::pi<double>() * ring / kRings;
    for (unsigned facet = 0; facet < kFacets; ++facet) {
      const double azimuth = 2 * glm::pi<double>() * facet / kFacets;
      add({std::sin(polar) * std::sin(azimuth), std::cos(polar),
           std::sin(polar) * std::cos(azimuth)});
    }
  }
  add({0, -1, 0});
  const auto bottom = static_cast<unsigned>(sphere.positions.size() - 1);
  const auto vertex = [](unsigned ring, unsigned facet) {
    return 1 + (ring - 1) * kFacets + facet % kFacets;
  };
  for (unsigned facet = 0; facet < kFacets; ++facet) {
    sphere.triangles.emplace_back(0, vertex(1, facet), vertex(1, facet + 1));
    sphere.triangles.emplace_back(bottom, vertex(kRings - 1, facet + 1), vertex(kRings - 1, facet));
    for (unsigned ring = 1; ring + 1 < kRings; ++ring) {
      const unsigned a = vertex(ring, facet), b = vertex(ring, facet + 1);
      const unsigned c = vertex(ring + 1, facet), d = vertex(ring + 1, facet + 1);
      sphere.triangles.emplace_back(a, c, b);
      sphere.triangles.emplace_back(b, c, d);
    }
  }
  return sphere;
}

Mesh make_half_space(const glm::vec3& point, const glm::vec3& normal, const Mesh& mesh) {
  const glm::dvec3 z = glm::normalize(glm::dvec3(normal));
  const glm::dvec3 aside = std::abs(z.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 x = glm::normalize(glm::cross(aside, z)), y = glm::cross(z, x);
  const Bounds bounds = bounds_of(mesh);
  const double in_front = glm::dot(bounds.center - glm::dvec3(point), z);
  const double depth = std::max(in_front, 0.0) + 2 * bounds.radius;
  const glm::dvec3 middle = bounds.center + z * (0.5 * depth - in_front);
  Mesh box = make_box(glm::vec3(4 * bounds.radius, 4 * bounds.radius, depth));
  glm::dmat4 placed(1);
  placed[0] = glm::dvec4(x, 0), placed[1] = glm::dvec4(y, 0), placed[2] = glm::dvec4(z, 0);
  placed[3] = glm::dvec4(middle, 1);
  transform_mesh(box, placed);
  return box;
}

glm::dmat4 between_origins(glm::dmat4 transform, const glm::dvec3& from, const glm::dvec3& to) {
  const glm::dvec3 shift = glm::dmat3(transform) * from - to;
  if (shift != glm::dvec3(0)) transform[3] += glm::dvec4(shift, 0);  // else keeps signed zeros
  return transform;
}

void transform_mesh(Mesh& mesh, const glm::dmat4& world_transform, const glm::dvec3& origin) {
  const glm::dmat4 transform = between_origins(world_transform, mesh.origin, origin);
  mesh.origin = origin;
  if (transform == glm::dmat4(1)) return;
  for (glm::vec3& p : mesh.positions) p = glm::vec3(transform * glm::dvec4(p, 1));
  const glm::dmat3 normals = glm::inverseTranspose(glm::dmat3(transform));
  for (glm::vec3& n : mesh.normals) n = glm::vec3(glm::normalize(normals * glm::dvec3(n)));
  if (glm::determinant(glm::dmat3(transform)) > 0) return;
  for (glm::uvec3& t : mesh.triangles) std::swap(t.y, t.z);
}

}  // namespace solidtex::pathtracer
