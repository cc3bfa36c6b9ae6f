// What paths do at surfaces: look for light and go on.
#include <algorithm>
#include <cmath>
#include <optional>

#include "plugins/pathtracer/integrator/tile.h"
#include "plugins/pathtracer/sampling/dimensions.h"
#include "plugins/pathtracer/sampling/vectorized.h"

namespace solidtex::pathtracer {
namespace {

constexpr int kRouletteDepth = 4;

}  // namespace

// A light for each path, all at once because that is faster.
void TileRenderer::choose_lights(int depth) {
  lights_.assign(paths_.size(), {});
  if (context_.settings.light_sampling == LightSampling::bsdf || context_.lights.empty()) return;
  above_.resize(paths_.size());
  light_numbers_.resize(paths_.size());
  for_each_some(paths_.size(), [&](std::size_t first, int some) {
    numbers_.draw(some, dimension(depth) + kLight, sampler_of(first));
    for (int i = 0; i < some; ++i)
      light_numbers_[first + static_cast<std::size_t>(i)] = numbers_[i];
  });
  for (std::size_t i = 0; i < paths_.size(); ++i) {
    above_[i] = context_.geometry.leave(surfaces_[i], surfaces_[i].geometric_normal);
  }
  context_.lights.sample(above_, light_numbers_, lights_);
}

// Lights each path and sends it on.
void TileRenderer::scatter(int depth) {
  choose_lights(depth);
  shadow_rays_.clear();
  direct_light_.clear();
  std::size_t kept = 0;
  std::optional<Coat> coat;
  for_each_some(paths_.size(), [&](std::size_t first, int some) {
    numbers_.draw(some, dimension(depth) + kDirection, sampler_of(first));
    for (int j = 0; j < some; ++j) {
      const std::size_t i = first + static_cast<std::size_t>(j);
      Path path = paths_[i];
      Ray ray = rays_[i];
      const Surface& surface = surfaces_[i];
      const Bsdf bsdf = context_.bsdfs[surface.material].at(found_[i], surface.inside, coat);
      const Frame frame(bumped_normal(surface.normal, found_[i].slope, -ray.direction));
      const glm::vec3 out = frame.to_local(-ray.direction);
      if (lights_[i].pdf > 0) aim_at(lights_[i], path, surface, bsdf, frame, out);
      if (!bounce(path, ray, surface, bsdf, frame, out, numbers_[j], depth)) continue;
      rays_[kept] = ray;
      paths_[kept++] = path;
    }
  });
  keep(kept);
}

void TileRenderer::aim_at(const LightSample& light, const Path& path, const Surface& surface,
                          const Bsdf& bsdf, const Frame& frame, const glm::vec3& out) {
  const glm::vec3 in = frame.to_local(light.direction);
  const float cosine = glm::dot(light.direction, surface.geometric_normal);
  if (cosine * in.z <= 0) return;
  const glm::vec3 reflected = bsdf.eval(out, in);
  if (reflected == glm::vec3(0)) return;
  const glm::vec3 origin = context_.geometry.leave(surface, light.direction);
  const float weight = context_.settings.light_sampling == LightSampling::mis
                           ? power_heuristic(light.pdf, bsdf.pdf(out, in))
                           : 1.0f;
  // Just short of the light itself.
  shadow_rays_.push_back({origin, light.direction, light.distance * 0.9999f});
  direct_light_.push_back(
      {path.slot, path.throughput * reflected * light.radiance * (weight / light.pdf)});
}

// Chooses the next ray; false when the path ends.
bool TileRenderer::bounce(Path& path, Ray& ray, const Surface& surface, const Bsdf& bsdf,
                          const Frame& frame, const glm::vec3& out,
                          const glm::vec2& direction_numbers, int depth) {
  const float lobe = bsdf.has_lobes() ? path.sampler.get_1d(dimension(depth) + kLobe) : 0;
  const BsdfSample next = bsdf.sample(out, lobe, direction_numbers);
  if (next.pdf <= 0) return false;
  const glm::vec3 direction = glm::normalize(frame.to_world(next.direction));
  if (glm::dot(direction, surface.geometric_normal) * next.direction.z <= 0) return false;
  path.throughput *= next.weight;
  path.compression *= next.ior * next.ior;
  const float brightest = std::max({path.throughput.x, path.throughput.y, path.throughput.z});
  if (brightest <= 0) return false;
  if (depth >= kRouletteDepth) {
    const float survival = std::min(brightest * path.compression, 0.95f);
    if (path.sampler.get_1d(dimension(depth) + kRoulette) >= survival) return false;
    path.throughput /= survival;
  }
  const float spread = ray.spread;
  ray = {.origin = context_.geometry.leave(surface, direction), .direction = direction};
  if (next.alpha >= 0) {
    // A reflected or refracted cone, wider by this sample's share of what the surface scatters.
    // After a diffuse bounce there is none: many directions average what they find.
    const float share = 1 / std::sqrt(static_cast<float>(context_.settings.samples));
    ray.radius = surface.footprint;
    ray.spread = spread / next.ior + 0.5f * next.alpha * share;
  }
  path.bsdf_pdf = next.pdf;
  return true;
}

}  // namespace solidtex::pathtracer
