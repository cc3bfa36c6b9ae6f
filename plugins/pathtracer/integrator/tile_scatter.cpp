// Next event estimation and BSDF sampling.
#include <algorithm>
#include <cmath>
#include <optional>

#include "plugins/pathtracer/integrator/tile.h"
#include "plugins/pathtracer/sampling/vectorized.h"

namespace solidtex::pathtracer {
namespace {

constexpr int kRouletteDepth = 4;

}  // namespace

// Samples a light for each path, in batches.
void TileRenderer::sample_lights(int depth) {
  light_samples_.assign(paths_.size(), {});
  if (context_.settings.light_sampling == LightSampling::bsdf || context_.lights.empty()) return;
  light_origins_.resize(paths_.size());
  light_u_.resize(paths_.size());
  for_each_batch(paths_.size(), [&](std::size_t first, int batch) {
    pairs_.draw(batch, dimension(depth) + kLight, sequence_of(first));
    for (int i = 0; i < batch; ++i) light_u_[first + static_cast<std::size_t>(i)] = pairs_[i];
  });
  for (std::size_t i = 0; i < paths_.size(); ++i) {
    light_origins_[i] =
        context_.geometry.offset_ray_origin(interactions_[i], interactions_[i].geometric_normal);
  }
  context_.lights.sample(light_origins_, light_u_, light_samples_);
}

// Adds direct light and samples the next ray of each path.
void TileRenderer::scatter(int depth) {
  sample_lights(depth);
  shadow_rays_.clear();
  direct_light_.clear();
  std::size_t kept = 0;
  std::optional<Coat> coat_storage;
  for_each_batch(paths_.size(), [&](std::size_t first, int batch) {
    pairs_.draw(batch, dimension(depth) + kDirection, sequence_of(first));
    for (int j = 0; j < batch; ++j) {
      const std::size_t i = first + static_cast<std::size_t>(j);
      Path path = paths_[i];
      Ray ray = rays_[i];
      const SurfaceInteraction& interaction = interactions_[i];
      const Bsdf bsdf = context_.bsdfs[interaction.material].at(material_samples_[i],
                                                                interaction.inside, coat_storage);
      const Frame frame(
          bumped_normal(interaction.normal, material_samples_[i].height_gradient, -ray.direction));
      const glm::vec3 out = frame.to_local(-ray.direction);
      if (light_samples_[i].pdf > 0)
        connect_light(light_samples_[i], path, interaction, bsdf, frame, out);
      if (!sample_next_ray(path, ray, interaction, bsdf, frame, out, pairs_[j], depth)) continue;
      rays_[kept] = ray;
      paths_[kept++] = path;
    }
  });
  truncate_paths(kept);
}

void TileRenderer::connect_light(const LightSample& light, const Path& path,
                                 const SurfaceInteraction& interaction, const Bsdf& bsdf,
                                 const Frame& frame, const glm::vec3& out) {
  const glm::vec3 in = frame.to_local(light.direction);
  const float cosine = glm::dot(light.direction, interaction.geometric_normal);
  if (cosine * in.z <= 0) return;
  const glm::vec3 reflected = bsdf.eval(out, in);
  if (reflected == glm::vec3(0)) return;
  const glm::vec3 origin = context_.geometry.offset_ray_origin(interaction, light.direction);
  const float weight = context_.settings.light_sampling == LightSampling::mis
                           ? power_heuristic(light.pdf, bsdf.pdf(out, in))
                           : 1.0f;
  // Ends slightly before the light.
  shadow_rays_.push_back({origin, light.direction, light.distance * 0.9999f});
  direct_light_.push_back(
      {path.slot, path.throughput * reflected * light.radiance * (weight / light.pdf)});
}

// Returns false if the path ends.
bool TileRenderer::sample_next_ray(Path& path, Ray& ray, const SurfaceInteraction& interaction,
                                   const Bsdf& bsdf, const Frame& frame, const glm::vec3& out,
                                   const glm::vec2& direction_u, int depth) {
  const float lobe = bsdf.has_lobes() ? path.sequence.get_1d(dimension(depth) + kLobe) : 0;
  const BsdfSample next = bsdf.sample(out, lobe, direction_u);
  if (next.pdf <= 0) return false;
  const glm::vec3 direction = glm::normalize(frame.to_world(next.direction));
  if (glm::dot(direction, interaction.geometric_normal) * next.direction.z <= 0) return false;
  path.throughput *= next.weight;
  path.eta_scale *= next.ior * next.ior;
  const float max_throughput = std::max({path.throughput.x, path.throughput.y, path.throughput.z});
  if (max_throughput <= 0) return false;
  if (depth >= kRouletteDepth) {
    const float survival = std::min(max_throughput * path.eta_scale, 0.95f);
    if (path.sequence.get_1d(dimension(depth) + kRoulette) >= survival) return false;
    path.throughput /= survival;
  }
  const float spread = ray.spread;
  ray = {.origin = context_.geometry.offset_ray_origin(interaction, direction),
         .direction = direction};
  if (next.alpha >= 0) {
    // Continues the cone, widened by this sample's fraction of the lobe. Diffuse bounces have no
    // cone: many directions average their textures.
    const float fraction = 1 / std::sqrt(static_cast<float>(context_.settings.samples));
    ray.radius = interaction.footprint;
    ray.spread = spread / next.ior + 0.5f * next.alpha * fraction;
  }
  path.bsdf_pdf = next.pdf;
  return true;
}

}  // namespace solidtex::pathtracer
