// A unit cube with the octant nearest to the viewer removed, and rays that hit it.
#pragma once

#include <array>
#include <optional>

namespace solidtex::tools {

using Vec3 = std::array<double, 3>;

inline Vec3 operator+(const Vec3& a, const Vec3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Vec3 operator-(const Vec3& a, const Vec3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Vec3 operator*(double s, const Vec3& a) { return {s * a[0], s * a[1], s * a[2]}; }
inline double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vec3 normalized(const Vec3& a);

struct Ray {
  Vec3 origin, direction;
};

struct Hit {
  double distance;
  Vec3 point, normal;
};

// The cube is [0, 1]^3 without (0.5, 1]^3.
std::optional<Hit> intersect_cut_cube(const Ray& ray);

}  // namespace solidtex::tools
