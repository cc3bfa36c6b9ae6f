#include "plugins/pathtracer/lights/lights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "plugins/pathtracer/sampling/sampling.h"
#include "plugins/pathtracer/sampling/vectorized.h"

namespace solidtex::pathtracer {
namespace {

// Of a point on a flat light that was chosen evenly over its area. `normal`: of the side that
// shines.
LightSample flat_light(const glm::vec3& direction, float distance, const glm::vec3& normal,
                       float area, const glm::vec3& radiance) {
  const float projected_area = -glm::dot(normal, direction) * area;
  if (projected_area <= 0) return {};
  return {direction, distance, radiance, distance * distance / projected_area};
}

LightSample flat_light_at(const glm::vec3& point, const glm::vec3& from, const glm::vec3& normal,
                          float area, const glm::vec3& radiance) {
  const glm::vec3 to_light = point - from;
  const float distance = glm::length(to_light);
  if (distance <= 0) return {};
  return flat_light(to_light / distance, distance, normal, area, radiance);
}

struct Plane {
  glm::vec3 normal;
  float area;
};
Plane plane_of(const RectangleLight& light) {
  const glm::vec3 normal = glm::cross(light.edge_u, light.edge_v);
  const float area = glm::length(normal);
  return {normal / area, area};
}

std::array<glm::vec3, 3> corners_of(const Mesh& mesh, std::size_t triangle) {
  const glm::uvec3& corner = mesh.triangles[triangle];
  return {mesh.positions[corner.x], mesh.positions[corner.y], mesh.positions[corner.z]};
}

glm::vec3 normal_of(const std::array<glm::vec3, 3>& p) {
  return glm::normalize(glm::cross(p[1] - p[0], p[2] - p[0]));
}

// One minus the cosine of the angle under which a sphere's radius is seen; 0 from within.
float cone_of(const SphereLight& light, const glm::vec3& from) {
  const glm::vec3 to_center = light.center - from;
  const float sine2 = light.radius * light.radius / glm::dot(to_center, to_center);
  return sine2 < 1 ? sine2 / (1 + std::sqrt(1 - sine2)) : 0;
}

float cone_pdf(float cone) { return cone > 0 ? 1 / (glm::two_pi<float>() * cone) : 0; }

// Even over the solid angle.
LightSample choose_on(const SphereLight& light, const glm::vec3& from, const glm::vec2& u) {
  const float cone = cone_of(light, from);
  if (cone <= 0) return {};
  const float rest = u.x * cone, cosine = 1 - rest;  // the difference would lose small cones
  const float sine = std::sqrt(rest * (1 + cosine));
  const glm::vec3 to_center = light.center - from;
  const float distance = glm::length(to_center);
  const Frame frame(to_center / distance);
  const float half_chord =
      std::sqrt(std::max(light.radius * light.radius - distance * distance * sine * sine, 0.0f));
  // A little in front of the sphere: at its rim rounding moves the hit most.
  return {frame.to_world(glm::vec3(sine * unit_circle(u.y), cosine)),
          distance * cosine - half_chord - 2e-3f * light.radius, light.radiance, cone_pdf(cone)};
}

// Where a uniform number falls among sums: which one, and how far (0 to 1) towards it.
struct Interval {
  std::size_t index;
  float fraction;
};
Interval find(const std::vector<double>& sums, float u) {
  const double target = u * sums.back();
  const auto found = std::upper_bound(sums.begin(), sums.end() - 1, target);
  const double start = found == sums.begin() ? 0 : *(found - 1);
  const auto fraction = static_cast<float>((target - start) / (*found - start));
  return {static_cast<std::size_t>(found - sums.begin()), fraction};
}

LightSample choose_on(const MeshLight& light, const std::vector<double>& area_sums,
                      const glm::vec3& from, const glm::vec2& u) {
  const auto [triangle, inner] = find(area_sums, u.x);
  const float root = std::sqrt(std::clamp(inner, 0.0f, 1.0f));
  const auto p = corners_of(light.mesh, triangle);
  const glm::vec3 point = (1 - root) * p[0] + root * (1 - u.y) * p[1] + root * u.y * p[2];
  return flat_light_at(point, from, normal_of(p), static_cast<float>(area_sums.back()),
                       light.radiance);
}

// Of picks that do not depend on power: a dim light may be the only one that reaches a place.
constexpr double kEvenShare = 0.25;

// Luminance that leaves a surface of one color, in all directions together.
double flux(const glm::vec3& radiance, double area) {
  return static_cast<double>(luminance(radiance)) * glm::pi<double>() * area;
}

double squared_length(const glm::vec3& v) { return static_cast<double>(glm::dot(v, v)); }

glm::vec3 middle_of(const Mesh& mesh) {
  glm::vec3 sum(0);
  for (const glm::vec3& position : mesh.positions) sum += position;
  return sum / static_cast<float>(mesh.positions.size());
}

}  // namespace

Lights::Lights(const Scene& scene) : scene_(scene) {
  for (const MeshLight& light : scene.mesh_lights) {
    auto& sums = area_sums_.emplace_back();
    for (std::size_t i = 0; i < light.mesh.triangles.size(); ++i) {
      const auto p = corners_of(light.mesh, i);
      const double area = 0.5 * glm::length(glm::cross(p[1] - p[0], p[2] - p[0]));
      sums.push_back((sums.empty() ? 0 : sums.back()) + area);
    }
  }
  if (scene.environment) environment_.emplace(*scene.environment);
  choose_shares(powers());
}

// Flux of every light. What the environment sends does not come from anywhere: it counts as a light
// at the others' distance that is as bright where the camera looks at. A light of power P lights a
// place at a distance d with up to P / (pi d^2), the environment on average with a quarter of all
// its radiance.
std::vector<double> Lights::powers() const {
  std::vector<double> result;
  double weighted_distances = 0;
  const auto add = [&](const glm::vec3& radiance, double area, const glm::vec3& middle) {
    result.push_back(flux(radiance, area));
    weighted_distances += result.back() * squared_length(middle - scene_.camera.look_at);
  };
  for (const RectangleLight& light : scene_.lights) {
    add(light.radiance, plane_of(light).area,
        light.corner + 0.5f * light.edge_u + 0.5f * light.edge_v);
  }
  for (const SphereLight& light : scene_.sphere_lights) {
    const double area = 4 * glm::pi<double>() * light.radius * light.radius;
    add(light.radiance, area, light.center);
  }
  for (std::size_t i = 0; i < scene_.mesh_lights.size(); ++i) {
    const MeshLight& light = scene_.mesh_lights[i];
    add(light.radiance, area_sums_[i].back(), middle_of(light.mesh));
  }
  if (environment_) {
    const double total = std::accumulate(result.begin(), result.end(), 0.0);
    const double squared_distance = total > 0 ? weighted_distances / total : 1;
    result.push_back(environment_->luminance_of_all() * 0.25 * glm::pi<double>() *
                     squared_distance);
  }
  return result;
}

void Lights::choose_shares(const std::vector<double>& powers) {
  const double total = std::accumulate(powers.begin(), powers.end(), 0.0);
  const double even = 1 / static_cast<double>(powers.size());
  // Lights without a sum, or with an infinite one, are equal.
  const double even_share = total > 0 && std::isfinite(total) ? kEvenShare : 1;
  for (const double power : powers) {
    double share = even_share * even;
    if (even_share < 1) share += (1 - even_share) * power / total;
    shares_.push_back(static_cast<float>(share));
    share_sums_.push_back((share_sums_.empty() ? 0 : share_sums_.back()) + share);
  }
}

void Lights::sample(std::span<const glm::vec3> from, std::span<const glm::vec2> u,
                    std::span<LightSample> samples) const {
  for_each_some(from.size(), [&](std::size_t first, int some) {
    const auto count = static_cast<std::size_t>(some);
    sample_some(from.subspan(first, count), u.subspan(first, count), samples.subspan(first, count));
  });
}

void Lights::sample_some(std::span<const glm::vec3> from, std::span<const glm::vec2> u,
                         std::span<LightSample> samples) const {
  std::array<std::uint32_t, kTogether> sky;  // those that chose the environment
  std::array<glm::vec2, kTogether> sky_u;
  std::size_t sky_count = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const auto [light, rest] = find(share_sums_, u[i].x);
    const glm::vec2 own(std::clamp(rest, 0.0f, 0x1.fffffep-1f), u[i].y);
    if (light < shape_count()) {
      samples[i] = sample_shape(light, from[i], own);
      samples[i].pdf *= shares_[light];
    } else {
      sky[sky_count] = static_cast<std::uint32_t>(i);
      sky_u[sky_count++] = own;
    }
  }
  if (sky_count == 0) return;
  std::array<Environment::Sample, kTogether> found;
  environment_->sample(std::span(sky_u).first(sky_count), found);
  for (std::size_t i = 0; i < sky_count; ++i) {
    samples[sky[i]] = {found[i].direction, std::numeric_limits<float>::infinity(),
                       found[i].seen.radiance, found[i].seen.pdf * shares_.back()};
  }
}

LightSample Lights::sample_shape(std::size_t light, const glm::vec3& from,
                                 const glm::vec2& u) const {
  if (light < scene_.lights.size()) {
    const RectangleLight& rectangle = scene_.lights[light];
    const auto [normal, area] = plane_of(rectangle);
    return flat_light_at(rectangle.corner + u.x * rectangle.edge_u + u.y * rectangle.edge_v, from,
                         normal, area, rectangle.radiance);
  }
  light -= scene_.lights.size();
  if (light < scene_.sphere_lights.size()) return choose_on(scene_.sphere_lights[light], from, u);
  light -= scene_.sphere_lights.size();
  return choose_on(scene_.mesh_lights[light], area_sums_[light], from, u);
}

void Lights::environment_seen(std::span<const glm::vec3> directions,
                              std::span<SeenLight> found) const {
  if (!environment_) {
    std::fill(found.begin(), found.end(), SeenLight{});
    return;
  }
  environment_->seen(directions, found);
  for (SeenLight& seen : found) seen.pdf *= shares_.back();
}

SeenLight Lights::light_seen(const LightHit& hit) const {
  LightSample result;
  std::size_t light = hit.light;
  if (light < scene_.lights.size()) {
    const auto [normal, area] = plane_of(scene_.lights[light]);
    result = flat_light(hit.direction, hit.distance, normal, area, scene_.lights[light].radiance);
  } else if (light -= scene_.lights.size(); light < scene_.sphere_lights.size()) {
    const SphereLight& sphere = scene_.sphere_lights[light];
    const float pdf = cone_pdf(cone_of(sphere, hit.origin));
    if (pdf > 0) result = {hit.direction, hit.distance, sphere.radiance, pdf};
  } else {
    light -= scene_.sphere_lights.size();
    const MeshLight& mesh = scene_.mesh_lights[light];
    result = flat_light(hit.direction, hit.distance, normal_of(corners_of(mesh.mesh, hit.triangle)),
                        static_cast<float>(area_sums_[light].back()), mesh.radiance);
  }
  return {result.radiance, result.pdf * shares_[hit.light]};
}

}  // namespace solidtex::pathtracer
