#include "plugins/pathtracer/lights.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "plugins/pathtracer/sampling.h"

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
  const float sine = std::sqrt(rest * (1 + cosine)), angle = glm::two_pi<float>() * u.y;
  const glm::vec3 to_center = light.center - from;
  const float distance = glm::length(to_center);
  const Frame frame(to_center / distance);
  const float half_chord =
      std::sqrt(std::max(light.radius * light.radius - distance * distance * sine * sine, 0.0f));
  // A little in front of the sphere: at its rim rounding moves the hit most.
  return {frame.to_world({sine * std::cos(angle), sine * std::sin(angle), cosine}),
          distance * cosine - half_chord - 2e-3f * light.radius, light.radiance, cone_pdf(cone)};
}

LightSample choose_on(const MeshLight& light, const std::vector<double>& area_sums,
                      const glm::vec3& from, const glm::vec2& u) {
  const double target = u.x * area_sums.back();
  const auto found = std::upper_bound(area_sums.begin(), area_sums.end() - 1, target);
  const auto triangle = static_cast<std::size_t>(found - area_sums.begin());
  const double start = triangle == 0 ? 0 : area_sums[triangle - 1];
  const auto inner = static_cast<float>((target - start) / (*found - start));
  const float root = std::sqrt(std::clamp(inner, 0.0f, 1.0f));
  const auto p = corners_of(light.mesh, triangle);
  const glm::vec3 point = (1 - root) * p[0] + root * (1 - u.y) * p[1] + root * u.y * p[2];
  return flat_light_at(point, from, normal_of(p), static_cast<float>(area_sums.back()),
                       light.radiance);
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
}

LightSample Lights::sample(const glm::vec3& from, const glm::vec2& u) const {
  const std::size_t count = light_count();
  const float place = u.x * static_cast<float>(count);
  const auto light = std::min(static_cast<std::size_t>(place), count - 1);
  const float rest = std::min(place - static_cast<float>(light), 0x1.fffffep-1f);
  LightSample result = sample_light(light, from, {rest, u.y});
  result.pdf /= static_cast<float>(count);
  return result;
}

LightSample Lights::sample_light(std::size_t light, const glm::vec3& from,
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
  if (light < scene_.mesh_lights.size()) {
    return choose_on(scene_.mesh_lights[light], area_sums_[light], from, u);
  }
  const DirectionSample chosen = environment_->sample(u);
  return {chosen.direction, std::numeric_limits<float>::infinity(),
          environment_->radiance(chosen.direction), chosen.pdf};
}

LightSample Lights::environment_seen(const glm::vec3& direction) const {
  if (!environment_) return {};
  const Environment::Seen seen = environment_->seen(direction);
  return {direction, std::numeric_limits<float>::infinity(), seen.radiance,
          seen.pdf / static_cast<float>(light_count())};
}

LightSample Lights::light_seen(const LightHit& hit) const {
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
  result.pdf /= static_cast<float>(light_count());
  return result;
}

}  // namespace solidtex::pathtracer
