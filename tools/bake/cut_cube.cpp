#include "tools/bake/cut_cube.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace solidtex::tools {
namespace {

// Where a ray is inside a box [lo, hi]^3, and through which axes' faces it comes and goes.
struct Span {
  double enter = -std::numeric_limits<double>::infinity();
  double leave = std::numeric_limits<double>::infinity();
  int enter_axis = 0, leave_axis = 0;
  bool empty() const { return enter >= leave; }
};

Span inside_box(const Ray& ray, double lo, double hi) {
  Span span;
  for (int axis = 0; axis < 3; ++axis) {
    const double step = ray.direction[axis];
    if (step == 0) {
      if (ray.origin[axis] < lo || ray.origin[axis] > hi) span.leave = span.enter;
      continue;
    }
    const auto [near, far] =
        std::minmax({(lo - ray.origin[axis]) / step, (hi - ray.origin[axis]) / step});
    if (near > span.enter) {
      span.enter = near;
      span.enter_axis = axis;
    }
    if (far < span.leave) {
      span.leave = far;
      span.leave_axis = axis;
    }
  }
  return span;
}

// A surface that the ray meets faces it.
Hit hit_at(const Ray& ray, double distance, int axis) {
  Vec3 normal{};
  normal[axis] = ray.direction[axis] > 0 ? -1 : 1;
  return {distance, ray.origin + distance * ray.direction, normal};
}

}  // namespace

Vec3 normalized(const Vec3& a) { return 1 / std::sqrt(dot(a, a)) * a; }

std::optional<Hit> intersect_cut_cube(const Ray& ray) {
  constexpr double epsilon = 1e-9;
  const Span cube = inside_box(ray, 0, 1);
  if (cube.empty() || cube.leave <= epsilon) return std::nullopt;
  const Span notch = inside_box(ray, 0.5, 1);
  const double start = std::max(cube.enter, 0.0);
  const bool starts_in_notch =
      !notch.empty() && notch.enter <= start + epsilon && notch.leave > start + epsilon;
  if (!starts_in_notch) {
    if (cube.enter <= epsilon) return std::nullopt;  // starts on the surface and goes outwards
    return hit_at(ray, cube.enter, cube.enter_axis);
  }
  if (notch.leave >= cube.leave - epsilon) return std::nullopt;
  return hit_at(ray, notch.leave, notch.leave_axis);
}

}  // namespace solidtex::tools
