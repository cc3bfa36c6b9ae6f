#include "plugins/pathtracer/integrator/tile.h"

#include <array>

#include "plugins/pathtracer/integrator/adaptive_sampling.h"
#include "plugins/pathtracer/sampling/vectorized.h"

namespace solidtex::pathtracer {
namespace {

// A random point in the cube [-1, 1]^3.
glm::vec3 jitter(const SampleSequence& sequence, int depth) {
  const std::uint32_t dimension = kJitter + 2 * static_cast<std::uint32_t>(depth);
  const glm::vec2 xy = sequence.get_2d(dimension);
  return 2.0f * glm::vec3(xy.x, xy.y, sequence.get_1d(dimension + 1)) - 1.0f;
}

}  // namespace

RenderContext::RenderContext(const Scene& scene_, const RenderSettings& settings_)
    : scene(scene_),
      settings(settings_),
      geometry(scene_),
      lights(scene_),
      camera(scene_.camera, settings_.width, settings_.height, settings_.samples),
      needs_paths(settings_.noise > 0 ||
                  settings_.aovs.has_any({Aov::beauty, Aov::variance, Aov::cost})),
      needs_first_hits(settings_.aovs.has_any(
          {Aov::albedo, Aov::normal, Aov::depth, Aov::position, Aov::texcoord, Aov::footprint})),
      needs_cost(settings_.aovs.has(Aov::cost)) {
  for (const Material& material : scene.materials) {
    bsdfs.emplace_back(material);
  }
}

bool TileRenderer::render(const Window& tile, std::uint32_t target, const Callbacks& callbacks) {
  tile_ = tile;
  watch_ = {};
  std::uint64_t left = remaining_samples(framebuffer_, context_.settings, tile_);
  while (choose_pixels(target)) {
    if (callbacks.should_stop && callbacks.should_stop()) return false;
    const std::uint32_t count = batch_size(target);
    start_paths(count);
    trace();
    accumulate(count);
    const std::uint64_t left_before = left;
    left = remaining_samples(framebuffer_, context_.settings, tile_);
    if (callbacks.on_samples) callbacks.on_samples(left_before - left);
  }
  return true;
}

void TileRenderer::trace() {
  const int last = context_.needs_paths ? context_.settings.max_depth : 1;
  for (int depth = 1; depth <= last && !paths_.empty(); ++depth) {
    intersect(depth);
    watch_.lap(statistics_.intersection_seconds);
    process_hits(depth);
    watch_.lap(statistics_.shading_seconds);
    const bool records = depth == 1 && context_.needs_first_hits;
    if (depth == last && !records) return;
    material_samples_.resize(interactions_.size());
    if (depth < last || context_.settings.aovs.has_any({Aov::albedo, Aov::normal})) {
      statistics_.texture_point_count += evaluate_materials_(interactions_, material_samples_);
    }
    watch_.lap(statistics_.texture_seconds);
    record_aovs(depth);
    if (depth < last) {
      scatter(depth);
      watch_.lap(statistics_.shading_seconds);
      add_unoccluded_light();
      watch_.lap(statistics_.intersection_seconds);
    }
  }
}

void TileRenderer::intersect(int depth) {
  statistics_.ray_count += rays_.size();
  hits_.resize(rays_.size());
  context_.geometry.intersect(rays_, depth == 1, hits_);
}

// Drops all paths but the first `count`.
void TileRenderer::truncate_paths(std::size_t count) {
  paths_.erase(paths_.begin() + static_cast<std::ptrdiff_t>(count), paths_.end());
  rays_.resize(count);
}

// Adds the environment to the paths that leave the scene.
void TileRenderer::add_environment(int depth) {
  std::array<std::size_t, kBatchSize> escaped;
  std::array<glm::vec3, kBatchSize> directions;
  std::array<EmittedLight, kBatchSize> lights;
  std::size_t count = 0;
  const auto add = [&] {
    context_.lights.evaluate_environment(std::span(directions).first(count), lights);
    for (std::size_t i = 0; i < count; ++i) add_emission(paths_[escaped[i]], lights[i], depth);
    count = 0;
  };
  for (std::size_t i = 0; i < paths_.size(); ++i) {
    if (hits_[i].kind != Hit::Kind::nothing) continue;
    escaped[count] = i;
    directions[count++] = rays_[i].direction;
    if (count == kBatchSize) add();
  }
  add();
}

// Adds the emission that rays hit, and keeps the paths that hit an object.
void TileRenderer::process_hits(int depth) {
  add_environment(depth);
  interactions_.clear();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < paths_.size(); ++i) {
    const Path& path = paths_[i];
    const Ray& ray = rays_[i];
    const Hit& hit = hits_[i];
    if (hit.kind == Hit::Kind::light) {
      add_emission(path,
                   context_.lights.evaluate(
                       {hit.index, hit.triangle, ray.origin, ray.direction, hit.distance}),
                   depth);
    } else if (hit.kind == Hit::Kind::object) {
      interactions_.push_back(context_.geometry.interaction(ray, hit));
      if (context_.settings.texture_filter == TextureFilter::stochastic) {
        interactions_.back().jitter = jitter(path.sequence, depth);
      }
      radiance_[path.slot] +=
          path.throughput * context_.scene.materials[interactions_.back().material].emission;
      rays_[kept] = ray;
      paths_[kept++] = path;
    }
  }
  truncate_paths(kept);
}

void TileRenderer::add_emission(const Path& path, const EmittedLight& light, int depth) {
  float weight = 1;
  if (depth > 1) {
    switch (context_.settings.light_sampling) {
      case LightSampling::mis:
        weight = power_heuristic(path.bsdf_pdf, light.pdf);
        break;
      case LightSampling::lights:
        weight = 0;
        break;
      case LightSampling::bsdf:
        weight = 1;
        break;
    }
  }
  radiance_[path.slot] += path.throughput * light.radiance * weight;
}

void TileRenderer::add_unoccluded_light() {
  statistics_.ray_count += shadow_rays_.size();
  occluded_.resize(shadow_rays_.size());
  context_.geometry.occluded(shadow_rays_, occluded_);
  for (std::size_t i = 0; i < shadow_rays_.size(); ++i) {
    if (!occluded_[i]) radiance_[direct_light_[i].slot] += direct_light_[i].radiance;
  }
}

}  // namespace solidtex::pathtracer
