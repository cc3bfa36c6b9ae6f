#include "plugins/mesh/formats/polygon_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "plugins/mesh/formats/text.h"
#include "plugins/mesh/formats/triangulate.h"
#include "plugins/mesh/vertex_table.h"

namespace solidtex::mesh {
namespace {

using Corner = PolygonMesh::Corner;
constexpr std::uint32_t kNone = PolygonMesh::kNone;

// Distance from zero, in sizes of the mesh, beyond which the mesh gets its own origin.
constexpr double kFar = 16;
constexpr double kMaxRounding = 0.25;  // texels

std::string text_of(const glm::dvec3& p) {
  std::string text;
  for (int axis = 0; axis < 3; ++axis) {
    text.append(axis == 0 ? "(" : ", ").append(number_text(p[axis]));
  }
  return text.append(")");
}

void check_positions(const PolygonMesh& polygons) {
  constexpr double kMax = std::numeric_limits<float>::max();
  for (std::size_t v = 0; v < polygons.positions.size(); ++v) {
    const glm::dvec3 &p = polygons.positions[v], size = glm::abs(p);
    if (size.x <= kMax && size.y <= kMax && size.z <= kMax) continue;
    refuse(polygons.file, "vertex " + std::to_string(v) + " at " + text_of(p),
           "finite coordinates: leave the vertex out, or export the mesh again");
  }
}

template <class T>
bool is_finite(const T& value) {
  return std::isfinite(glm::dot(value, value));
}

// A zero normal is none: the surface is flat there.
void check_normals(PolygonMesh& polygons) {
  if (polygons.normals.empty()) return;
  for (glm::vec3& normal : polygons.normals) {
    if (!is_finite(normal)) normal = glm::vec3(0);
  }
  const auto has_normal = [&](const Corner& corner) {
    return corner.normal != kNone && polygons.normals[corner.normal] != glm::vec3(0);
  };
  if (std::ranges::none_of(polygons.corners, has_normal)) polygons.normals.clear();
}

// Where only some faces have texture coordinates, the others get a place without area.
void check_uvs(PolygonMesh& polygons) {
  if (polygons.uvs.empty()) return;
  const auto is_missing = [&](const Corner& corner) {
    return corner.uv == kNone || !is_finite(polygons.uvs[corner.uv]);
  };
  const auto nowhere = static_cast<std::uint32_t>(polygons.uvs.size());
  std::uint64_t without = 0;
  std::size_t first = 0;
  for (const std::uint32_t size : polygons.face_sizes) {
    const std::span face(polygons.corners.data() + first, size);
    first += size;
    if (std::ranges::none_of(face, is_missing)) continue;
    ++without;
    for (Corner& corner : face) corner.uv = nowhere;
  }
  if (without == polygons.face_sizes.size()) polygons.uvs.clear();
  if (polygons.uvs.empty()) return;
  for (glm::vec2& uv : polygons.uvs) {
    if (!is_finite(uv)) uv = glm::vec2(0);
  }
  if (without == 0) return;
  polygons.uvs.emplace_back(0);
  polygons.keeps_vertices = false;
  polygons.warnings.push_back(std::to_string(without) + " of " +
                              count_of(polygons.face_sizes.size(), "face") +
                              " without texture coordinates");
}

// Near the middle of what faces use, and round enough that nothing is lost by subtracting it.
glm::dvec3 choose_origin(const PolygonMesh& polygons) {
  if (polygons.corners.empty()) return glm::dvec3(0);
  glm::dvec3 low = polygons.positions[polygons.corners.front().position], high = low;
  for (const Corner& corner : polygons.corners) {
    low = glm::min(low, polygons.positions[corner.position]);
    high = glm::max(high, polygons.positions[corner.position]);
  }
  const auto largest = [](const glm::dvec3& v) { return std::max({v.x, v.y, v.z}); };
  const double size = largest(high - low);
  const double away = largest(glm::max(glm::abs(low), glm::abs(high)));
  if (size == 0 || away <= kFar * size) return glm::dvec3(0);
  const double step = std::exp2(std::ceil(std::log2(size)));
  return glm::round(0.5 * (low + high) / step) * step;
}

class Builder {
 public:
  explicit Builder(const PolygonMesh& polygons) : from_(polygons) {
    mesh_.file = polygons.file;
    mesh_.origin = choose_origin(polygons);
  }

  Mesh build() {
    const std::vector<unsigned> vertices = from_.keeps_vertices ? keep_vertices() : share_corners();
    add_triangles(vertices);
    mesh_.rounding_error = std::max(mesh_.rounding_error, from_.rounding_error);
    mesh_.warnings = from_.warnings;
    if (dropped_ > 0) {
      mesh_.warnings.push_back(count_of(dropped_, "face") +
                               " with fewer than three different vertices left out");
    }
    if (mesh_.triangles.empty()) {
      std::string found = "no triangles";
      for (const std::string& warning : mesh_.warnings) found.append("; ").append(warning);
      refuse(from_.file, found,
             from_.face_sizes.empty() && !from_.positions.empty()
                 ? "at least one: these are points without a surface"
                 : "at least one: export a mesh with faces");
    }
    return std::move(mesh_);
  }

 private:
  glm::vec3 position(std::size_t index) {
    const glm::dvec3& exact = from_.positions[index];
    const glm::vec3 rounded(exact - mesh_.origin);
    const glm::dvec3 error = glm::abs(mesh_.origin + glm::dvec3(rounded) - exact);
    mesh_.rounding_error = std::max({mesh_.rounding_error, error.x, error.y, error.z});
    return rounded;
  }

  // Of each corner the number of its vertex.
  std::vector<unsigned> keep_vertices() {
    for (std::size_t v = 0; v < from_.positions.size(); ++v) {
      mesh_.positions.push_back(position(v));
    }
    mesh_.normals = from_.normals;
    mesh_.uvs = from_.uvs;
    mesh_.attribute = from_.attribute;
    std::vector<unsigned> vertices;
    vertices.reserve(from_.corners.size());
    for (const Corner& corner : from_.corners) vertices.push_back(corner.position);
    return vertices;
  }

  std::vector<unsigned> share_corners() {
    VertexTable table(mesh_, !from_.normals.empty(), !from_.uvs.empty());
    std::vector<unsigned> vertices;
    vertices.reserve(from_.corners.size());
    for (const Corner& corner : from_.corners) {
      vertices.push_back(table.add(position(corner.position),
                                   from_.normals.empty() || corner.normal == kNone
                                       ? glm::vec3(0)
                                       : from_.normals[corner.normal],
                                   from_.uvs.empty() ? glm::vec2(0) : from_.uvs[corner.uv]));
      if (from_.attribute.empty() || vertices.back() < mesh_.attribute.size()) continue;
      mesh_.attribute.push_back(from_.attribute[corner.position]);
    }
    return vertices;
  }

  void add_triangles(const std::vector<unsigned>& vertices) {
    std::vector<glm::dvec3> face;
    std::vector<glm::uvec3> triangles;
    std::size_t first = 0;
    for (std::size_t f = 0; f < from_.face_sizes.size(); ++f) {
      face.clear();
      triangles.clear();
      for (std::uint32_t i = 0; i < from_.face_sizes[f]; ++i) {
        face.push_back(from_.positions[from_.corners[first + i].position]);
      }
      if (is_triangle(from_.corners.data() + first, face.size())) {
        triangles.emplace_back(0, 1, 2);
      } else if (!triangulate(face, triangles, triangulation_budget_)) {
        refuse(from_.file,
               "face " + std::to_string(f) + " with " + std::to_string(face.size()) + " vertices",
               "smaller or simpler polygons: split it in the program that made it");
      }
      if (triangles.empty()) ++dropped_;
      for (const glm::uvec3& t : triangles) {
        mesh_.triangles.emplace_back(vertices[first + t.x], vertices[first + t.y],
                                     vertices[first + t.z]);
      }
      first += face.size();
    }
  }

  // Three vertices, maybe at one place: the file's triangles stay as they are.
  static bool is_triangle(const Corner* face, std::size_t count) {
    return count == 3 && face[0].position != face[1].position &&
           face[1].position != face[2].position && face[2].position != face[0].position;
  }

  const PolygonMesh& from_;
  Mesh mesh_;
  std::uint64_t dropped_ = 0;
  std::uint64_t triangulation_budget_ = kTriangulationBudget;
};

}  // namespace

void refuse(const std::string& file, const std::string& found, const std::string& expected) {
  throw MeshError(file + ": found " + found + ", expected " + expected);
}

std::string count_of(std::uint64_t count, const std::string& noun) {
  if (count == 1) return "1 " + noun;
  return std::to_string(count) + " " + (noun == "vertex" ? "vertices" : noun + "s");
}

Mesh to_mesh(PolygonMesh polygons) {
  check_positions(polygons);
  check_normals(polygons);
  check_uvs(polygons);
  return Builder(polygons).build();
}

std::string rounding_warning(const Mesh& mesh, double texels_per_unit) {
  const double texels = mesh.rounding_error * texels_per_unit;
  if (texels <= kMaxRounding) return "";
  const auto text = [](double value) {
    std::string digits(32, '\0');
    digits.resize(
        static_cast<std::size_t>(std::snprintf(digits.data(), digits.size(), "%.2g", value)));
    return digits;
  };
  return "coordinates are rounded by up to " + text(mesh.rounding_error) + " units, which is " +
         text(texels) +
         " texels: export the mesh nearer to its origin, or with coordinates in double precision";
}

}  // namespace solidtex::mesh
