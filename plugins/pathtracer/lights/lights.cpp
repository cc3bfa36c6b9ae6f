#include "plugins/pathtracer/lights/lights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <numeric>

#include "plugins/pathtracer/sampling/sampling.h"
#include "plugins/pathtracer/sampling/vectorized.h"
#include "plugins/pathtracer/scene/color.h"

namespace solidtex::pathtracer {
namespace {

// A point sampled uniformly by area on a flat light. `normal`: of the emitting side.
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

// One minus the cosine of the sphere's half angle; 0 from inside.
float cone_of(const SphereLight& light, const glm::vec3& from) {
  const glm::vec3 to_center = light.center - from;
  const float sine2 = light.radius * light.radius / glm::dot(to_center, to_center);
  return sine2 < 1 ? sine2 / (1 + std::sqrt(1 - sine2)) : 0;
}

float cone_pdf(float cone) { return cone > 0 ? 1 / (glm::two_pi<float>() * cone) : 0; }

// Uniform over the solid angle.
LightSample choose_on(const SphereLight& light, const glm::vec3& from, const glm::vec2& u) {
  const float cone = cone_of(light, from);
  if (cone <= 0) return {};
  const float rest = u.x * cone, cosine = 1 - rest;  // the difference would cancel for small cones
  const float sine = std::sqrt(rest * (1 + cosine));
  const glm::vec3 to_center = light.center - from;
  const float distance = glm::length(to_center);
  const Frame frame(to_center / distance);
  const float half_chord =
      std::sqrt(std::max(light.radius * light.radius - distance * distance * sine * sine, 0.0f));
  // Ends slightly in front of the sphere: rounding moves hits at its rim most.
  return {frame.to_world(glm::vec3(sine * unit_circle(u.y), cosine)),
          distance * cosine - half_chord - 2e-3f * light.radius, light.radiance, cone_pdf(cone)};
}

// The entry of cumulative sums at a uniform number, and the relative position (0 to 1) in its
// interval.
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

// Fraction of samples spread evenly over lights: a dim light may be the only one that reaches a
// point.
constexpr double kEvenFraction = 0.25;

// Luminous exitance of a diffuse emitter times its area.
double flux(const glm::vec3& radiance, double area) {
  return static_cast<double>(luminance(radiance)) * glm::pi<double>() * area;
}

double squared_length(const glm::vec3& v) { return static_cast<double>(glm::dot(v, v)); }

glm::vec3 centroid(const Mesh& mesh) {
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
  choose_probabilities(powers());
}

// Flux of every light. The environment counts as a light at the mean distance of the others with
// the same irradiance at the look-at point: a light of power P gives up to P / (pi d^2) at a
// distance d, the environment on average a quarter of its integrated radiance.
std::vector<double> Lights::powers() const {
  std::vector<double> result;
  double weighted_distances = 0;
  const auto add = [&](const glm::vec3& radiance, double area, const glm::vec3& center) {
    result.push_back(flux(radiance, area));
    weighted_distances += result.back() * squared_length(center - scene_.camera.look_at);
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
    add(light.radiance, area_sums_[i].back(), centroid(light.mesh));
  }
  if (environment_) {
    const double total = std::accumulate(result.begin(), result.end(), 0.0);
    const double squared_distance = total > 0 ? weighted_distances / total : 1;
    result.push_back(environment_->total_luminance() * 0.25 * glm::pi<double>() * squared_distance);
  }
  return result;
}

void Lights::choose_probabilities(const std::vector<double>& powers) {
  const double total = std::accumulate(powers.begin(), powers.end(), 0.0);
  const double even = 1 / static_cast<double>(powers.size());
  // Without a finite positive total all lights are equally likely.
  const double even_fraction = total > 0 && std::isfinite(total) ? kEvenFraction : 1;
  for (const double power : powers) {
    double probability = even_fraction * even;
    if (even_fraction < 1) probability += (1 - even_fraction) * power / total;
    probabilities_.push_back(static_cast<float>(probability));
    probability_sums_.push_back((probability_sums_.empty() ? 0 : probability_sums_.back()) +
                                probability);
  }
}

void Lights::sample(std::span<const glm::vec3> from, std::span<const glm::vec2> u,
                    std::span<LightSample> samples) const {
  for_each_batch(from.size(), [&](std::size_t first, int batch) {
    const auto count = static_cast<std::size_t>(batch);
    sample_batch(from.subspan(first, count), u.subspan(first, count),
                 samples.subspan(first, count));
  });
}

void Lights::sample_batch(std::span<const glm::vec3> from, std::span<const glm::vec2> u,
                          std::span<LightSample> samples) const {
  std::array<std::uint32_t, kBatchSize> sky;  // samples of the environment
  std::array<glm::vec2, kBatchSize> sky_u;
  std::size_t sky_count = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const auto [light, rest] = find(probability_sums_, u[i].x);
    const glm::vec2 own(std::clamp(rest, 0.0f, 0x1.fffffep-1f), u[i].y);
    if (light < shape_count()) {
      samples[i] = sample_shape(light, from[i], own);
      samples[i].pdf *= probabilities_[light];
    } else {
      sky[sky_count] = static_cast<std::uint32_t>(i);
      sky_u[sky_count++] = own;
    }
  }
  if (sky_count == 0) return;
  std::array<Environment::Sample, kBatchSize> environment;
  environment_->sample(std::span(sky_u).first(sky_count), environment);
  for (std::size_t i = 0; i < sky_count; ++i) {
    samples[sky[i]] = {environment[i].direction, std::numeric_limits<float>::infinity(),
                       environment[i].light.radiance,
                       environment[i].light.pdf * probabilities_.back()};
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

void Lights::evaluate_environment(std::span<const glm::vec3> directions,
                                  std::span<EmittedLight> lights) const {
  if (!environment_) {
    std::fill(lights.begin(), lights.end(), EmittedLight{});
    return;
  }
  environment_->evaluate(directions, lights);
  for (EmittedLight& light : lights) light.pdf *= probabilities_.back();
}

EmittedLight Lights::evaluate(const LightHit& hit) const {
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
  return {result.radiance, result.pdf * probabilities_[hit.light]};
}

}  // namespace solidtex::pathtracer
