#include "tools/bake/cut_cube.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace solidtex::tools {
namespace {

constexpr int sky_rays = 8, sun_rays = 4;
constexpr double sun_share = 0.58;  // of the light on an unshaded floor; the rest is sky
constexpr double sun_radius = 0.13;
constexpr double bounce = 0.1;  // light reflected by the floor and the cube itself
constexpr double offset = 1e-6;

const glm::dvec3 sun_direction = glm::normalize(glm::dvec3{0.85, 0.4, 1.05});
const glm::dvec3 eye{3.15, 2.55, 2.35}, target{0.5, 0.5, 0.44};
constexpr double half_width = 0.225;  // tangent of half the field of view

// The part of a ray inside a box [lo, hi]^3, and the axes of the faces where it enters and leaves.
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

// The normal points against the ray.
Hit hit_at(const Ray& ray, double distance, int axis) {
  glm::dvec3 normal(0);
  normal[axis] = ray.direction[axis] > 0 ? -1 : 1;
  return {ray.origin + distance * ray.direction, normal};
}

double fraction(double value) { return value - std::floor(value); }

std::uint32_t hash(std::uint32_t x) {
  x = (x ^ (x >> 16)) * 0x7FEB352Du;
  x = (x ^ (x >> 15)) * 0x846CA68Bu;
  return x ^ (x >> 16);
}

// Two vectors that complete n to an orthonormal basis.
std::pair<glm::dvec3, glm::dvec3> tangents(const glm::dvec3& n) {
  const glm::dvec3 other = std::abs(n[2]) < 0.9 ? glm::dvec3{0, 0, 1} : glm::dvec3{1, 0, 0};
  const glm::dvec3 a = glm::normalize(glm::cross(other, n));
  return {a, glm::cross(n, a)};
}

// A point on a circle around `axis`, at the given height along it.
glm::dvec3 around(const glm::dvec3& axis, double radius, double height, double angle) {
  const auto [a, b] = tangents(axis);
  return height * axis + (radius * std::cos(angle)) * a + (radius * std::sin(angle)) * b;
}

bool blocked(const glm::dvec3& point, const glm::dvec3& direction) {
  return intersect_cut_cube({point, direction}).has_value();
}

// The visible part of the sky, weighted by the cosine.
double sky_light(const glm::dvec3& point, const glm::dvec3& normal, SampleSequence& samples) {
  double sum = 0;
  for (int i = 0; i < sky_rays; ++i) {
    const glm::dvec2 s = samples.next();
    const glm::dvec3 direction =
        around(normal, std::sqrt(s.x), std::sqrt(1 - s.x), 2 * std::numbers::pi * s.y);
    if (direction[2] <= 0 || blocked(point, direction)) continue;
    sum += 1;
  }
  return sum / sky_rays;
}

double sun_light(const glm::dvec3& point, const glm::dvec3& normal, SampleSequence& samples) {
  double sum = 0;
  for (int i = 0; i < sun_rays; ++i) {
    const glm::dvec2 s = samples.next();
    const glm::dvec3 direction = glm::normalize(
        around(sun_direction, sun_radius * std::sqrt(s.x), 1, 2 * std::numbers::pi * s.y));
    const double cosine = glm::dot(direction, normal);
    if (cosine > 0 && !blocked(point, direction)) sum += cosine;
  }
  return sum / sun_rays / sun_direction[2];
}

}  // namespace

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

SampleSequence::SampleSequence(std::uint32_t pixel)
    : point_(hash(pixel) * 0x1p-32, hash(pixel ^ 0x9E3779B9u) * 0x1p-32) {}

glm::dvec2 SampleSequence::next() {
  // The plastic number's reciprocal and its square.
  point_ = {fraction(point_.x + 0.7548776662466927), fraction(point_.y + 0.5698402909980532)};
  return point_;
}

double irradiance(const glm::dvec3& point, const glm::dvec3& normal, SampleSequence& samples) {
  const glm::dvec3 start = point + offset * normal;
  return bounce + (1 - bounce) * (sun_share * sun_light(start, normal, samples) +
                                  (1 - sun_share) * sky_light(start, normal, samples));
}

Ray camera_ray(double x, double y) {
  static const glm::dvec3 forward = glm::normalize(target - eye);
  static const glm::dvec3 right = glm::normalize(glm::cross(forward, glm::dvec3{0, 0, 1}));
  static const glm::dvec3 up = glm::cross(right, forward);
  const double across = half_width * (2 * x - 1), along = half_width * (1 - 2 * y);
  return {eye, glm::normalize(forward + across * right + along * up)};
}

}  // namespace solidtex::tools
