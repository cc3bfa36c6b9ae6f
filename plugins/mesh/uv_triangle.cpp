#include "plugins/mesh/uv_triangle.h"

#include <algorithm>
#include <cmath>

namespace solidtex::mesh {
namespace {

constexpr double kMinArea = 1e-16;  // twice that of a triangle, of the whole atlas

}  // namespace

std::optional<UvTriangle> UvTriangle::of(const Mesh& mesh, std::size_t triangle, int size) {
  const glm::uvec3& t = mesh.triangles[triangle];
  glm::dvec2 texels[3];
  for (int i = 0; i < 3; ++i) {
    const glm::dvec2 uv(mesh.uvs[t[i]]);
    texels[i] = glm::dvec2(uv.x, 1 - uv.y) * static_cast<double>(size);
  }
  const glm::dvec2 a = texels[1] - texels[0], b = texels[2] - texels[0];
  const double area = a.x * b.y - a.y * b.x;
  if (!(std::abs(area) > kMinArea * size * size)) return std::nullopt;

  UvTriangle result;
  result.at_ = texels[0];
  result.low_ = glm::min(texels[0], glm::min(texels[1], texels[2]));
  result.high_ = glm::max(texels[0], glm::max(texels[1], texels[2]));
  result.second_ = glm::dvec2(b.y, -b.x) / area;
  result.third_ = glm::dvec2(-a.y, a.x) / area;
  result.corner_ = mesh.positions[t.x];
  const glm::dvec3 p = glm::dvec3(mesh.positions[t.y]) - result.corner_;
  const glm::dvec3 q = glm::dvec3(mesh.positions[t.z]) - result.corner_;
  result.right_ = p * result.second_.x + q * result.third_.x;
  result.down_ = p * result.second_.y + q * result.third_.y;
  return result;
}

double UvTriangle::inside(const glm::dvec2& texel) const {
  const glm::dvec2 from = texel - at_;
  const double second = glm::dot(second_, from), third = glm::dot(third_, from);
  return std::min({1 - second - third, second, third});
}

}  // namespace solidtex::mesh
