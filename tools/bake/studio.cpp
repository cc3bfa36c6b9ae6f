#include "tools/bake/studio.h"

#include <cmath>
#include <numbers>

namespace solidtex::tools {
namespace {

constexpr int sky_rays = 8, sun_rays = 4;
constexpr double sun_share = 0.58;  // of the light on an open floor; the sky gives the rest
constexpr double sun_radius = 0.13;
constexpr double bounce = 0.1;  // light that the floor and the cube's own faces send back
constexpr double offset = 1e-6;

const Vec3 sun_direction = normalized({0.85, 0.4, 1.05});
const Vec3 eye{3.15, 2.55, 2.35}, target{0.5, 0.5, 0.44};
constexpr double half_width = 0.225;  // tangent of half the field of view

double fraction(double value) { return value - std::floor(value); }

std::uint32_t hash(std::uint32_t x) {
  x = (x ^ (x >> 16)) * 0x7FEB352Du;
  x = (x ^ (x >> 15)) * 0x846CA68Bu;
  return x ^ (x >> 16);
}

// Any two vectors that complete n to an orthonormal basis.
std::array<Vec3, 2> tangents(const Vec3& n) {
  const Vec3 other = std::abs(n[2]) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0};
  const Vec3 a = normalized(cross(other, n));
  return {a, cross(n, a)};
}

// Disk of the given radius around `axis`, seen from the origin.
Vec3 around(const Vec3& axis, double radius, double height, double angle) {
  const auto [a, b] = tangents(axis);
  return height * axis + (radius * std::cos(angle)) * a + (radius * std::sin(angle)) * b;
}

bool blocked(const Vec3& point, const Vec3& direction) {
  return intersect_cut_cube({point, direction}).has_value();
}

// Share of the sky that the surface sees, weighted by the cosine.
double sky_light(const Vec3& point, const Vec3& normal, Samples& samples) {
  double sum = 0;
  for (int i = 0; i < sky_rays; ++i) {
    const auto [u, v] = samples.next();
    const Vec3 direction = around(normal, std::sqrt(u), std::sqrt(1 - u), 2 * std::numbers::pi * v);
    if (direction[2] <= 0 || blocked(point, direction)) continue;
    sum += 1;
  }
  return sum / sky_rays;
}

double sun_light(const Vec3& point, const Vec3& normal, Samples& samples) {
  double sum = 0;
  for (int i = 0; i < sun_rays; ++i) {
    const auto [u, v] = samples.next();
    const Vec3 direction =
        normalized(around(sun_direction, sun_radius * std::sqrt(u), 1, 2 * std::numbers::pi * v));
    const double cosine = dot(direction, normal);
    if (cosine > 0 && !blocked(point, direction)) sum += cosine;
  }
  return sum / sun_rays / sun_direction[2];
}

}  // namespace

Samples::Samples(std::uint32_t pixel)
    : u_(hash(pixel) * 0x1p-32), v_(hash(pixel ^ 0x9E3779B9u) * 0x1p-32) {}

Samples::Pair Samples::next() {
  u_ = fraction(u_ + 0.7548776662466927);  // the plastic number's reciprocal and its square
  v_ = fraction(v_ + 0.5698402909980532);
  return {u_, v_};
}

double irradiance(const Vec3& point, const Vec3& normal, Samples& samples) {
  const Vec3 start = point + offset * normal;
  return bounce + (1 - bounce) * (sun_share * sun_light(start, normal, samples) +
                                  (1 - sun_share) * sky_light(start, normal, samples));
}

Ray camera_ray(double x, double y) {
  static const Vec3 forward = normalized(target - eye);
  static const Vec3 right = normalized(cross(forward, {0, 0, 1}));
  static const Vec3 up = cross(right, forward);
  const double across = half_width * (2 * x - 1), along = half_width * (1 - 2 * y);
  return {eye, normalized(forward + across * right + along * up)};
}

}  // namespace solidtex::tools
