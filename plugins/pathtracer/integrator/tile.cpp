#include "plugins/pathtracer/integrator/tile.h"

#include <array>

#include "plugins/pathtracer/integrator/convergence.h"
#include "plugins/pathtracer/sampling/dimensions.h"
#include "plugins/pathtracer/sampling/vectorized.h"

namespace solidtex::pathtracer {
namespace {

// A place in the cube [-1, 1]^3.
glm::vec3 jitter(const Sampler& sampler, int depth) {
  const std::uint32_t dimension = kJitter + 2 * static_cast<std::uint32_t>(depth);
  const glm::vec2 xy = sampler.get_2d(dimension);
  return 2.0f * glm::vec3(xy.x, xy.y, sampler.get_1d(dimension + 1)) - 1.0f;
}

}  // namespace

RenderContext::RenderContext(const Scene& scene_, const RenderSettings& settings_)
    : scene(scene_),
      settings(settings_),
      geometry(scene_),
      lights(scene_),
      camera(scene_.camera, settings_.width, settings_.height, settings_.samples),
      needs_paths(settings_.noise > 0 ||
                  settings_.layers.has_any({Layer::beauty, Layer::variance, Layer::cost})),
      needs_first_hits(
          settings_.layers.has_any({Layer::albedo, Layer::normal, Layer::depth, Layer::position,
                                    Layer::texcoord, Layer::footprint})),
      needs_cost(settings_.layers.has(Layer::cost)) {
  for (const Material& material : scene.materials) {
    bsdfs.emplace_back(material);
  }
}

bool TileRenderer::render(const Window& tile, std::uint32_t target, const Hooks& hooks) {
  tile_ = tile;
  watch_ = {};
  std::uint64_t left = samples_left(framebuffer_, context_.settings, tile_);
  while (choose_pixels(target)) {
    if (hooks.should_stop && hooks.should_stop()) return false;
    const std::uint32_t count = batch_size(target);
    start_paths(count);
    trace();
    accumulate(count);
    const std::uint64_t left_before = left;
    left = samples_left(framebuffer_, context_.settings, tile_);
    if (hooks.on_samples) hooks.on_samples(left_before - left);
  }
  return true;
}

void TileRenderer::trace() {
  const int last = context_.needs_paths ? context_.settings.max_depth : 1;
  for (int depth = 1; depth <= last && !paths_.empty(); ++depth) {
    intersect(depth);
    watch_.lap(statistics_.intersection_seconds);
    arrive(depth);
    watch_.lap(statistics_.shading_seconds);
    const bool records = depth == 1 && context_.needs_first_hits;
    if (depth == last && !records) return;
    found_.resize(surfaces_.size());
    if (depth < last || context_.settings.layers.has_any({Layer::albedo, Layer::normal})) {
      statistics_.texture_point_count += lookup_(surfaces_, found_);
    }
    watch_.lap(statistics_.texture_seconds);
    record(depth);
    if (depth < last) {
      scatter(depth);
      watch_.lap(statistics_.shading_seconds);
      add_unshadowed_light();
      watch_.lap(statistics_.intersection_seconds);
    }
  }
}

void TileRenderer::intersect(int depth) {
  statistics_.ray_count += rays_.size();
  hits_.resize(rays_.size());
  context_.geometry.intersect(rays_, depth == 1, hits_);
}

// Forgets all paths but the first ones.
void TileRenderer::keep(std::size_t count) {
  paths_.erase(paths_.begin() + static_cast<std::ptrdiff_t>(count), paths_.end());
  rays_.resize(count);
}

// Adds what lies around the scene to the paths that leave it.
void TileRenderer::escape(int depth) {
  std::array<std::size_t, kTogether> gone;
  std::array<glm::vec3, kTogether> directions;
  std::array<SeenLight, kTogether> found;
  std::size_t count = 0;
  const auto add = [&] {
    context_.lights.environment_seen(std::span(directions).first(count), found);
    for (std::size_t i = 0; i < count; ++i) add_emitted(paths_[gone[i]], found[i], depth);
    count = 0;
  };
  for (std::size_t i = 0; i < paths_.size(); ++i) {
    if (hits_[i].kind != Hit::Kind::nothing) continue;
    gone[count] = i;
    directions[count++] = rays_[i].direction;
    if (count == kTogether) add();
  }
  add();
}

// Adds what the rays found glowing and keeps the paths that arrived at an object.
void TileRenderer::arrive(int depth) {
  escape(depth);
  surfaces_.clear();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < paths_.size(); ++i) {
    const Path& path = paths_[i];
    const Ray& ray = rays_[i];
    const Hit& hit = hits_[i];
    if (hit.kind == Hit::Kind::light) {
      add_emitted(path,
                  context_.lights.light_seen(
                      {hit.index, hit.triangle, ray.origin, ray.direction, hit.distance}),
                  depth);
    } else if (hit.kind == Hit::Kind::object) {
      surfaces_.push_back(context_.geometry.surface(ray, hit));
      if (context_.settings.texture_filter == TextureFilter::stochastic) {
        surfaces_.back().jitter = jitter(path.sampler, depth);
      }
      radiance_[path.slot] +=
          path.throughput * context_.scene.materials[surfaces_.back().material].emission;
      rays_[kept] = ray;
      paths_[kept++] = path;
    }
  }
  keep(kept);
}

void TileRenderer::add_emitted(const Path& path, const SeenLight& seen, int depth) {
  float weight = 1;
  if (depth > 1) {
    switch (context_.settings.light_sampling) {
      case LightSampling::mis:
        weight = power_heuristic(path.bsdf_pdf, seen.pdf);
        break;
      case LightSampling::lights:
        weight = 0;
        break;
      case LightSampling::bsdf:
        weight = 1;
        break;
    }
  }
  radiance_[path.slot] += path.throughput * seen.radiance * weight;
}

void TileRenderer::add_unshadowed_light() {
  statistics_.ray_count += shadow_rays_.size();
  is_shadowed_.resize(shadow_rays_.size());
  context_.geometry.occluded(shadow_rays_, is_shadowed_);
  for (std::size_t i = 0; i < shadow_rays_.size(); ++i) {
    if (!is_shadowed_[i]) radiance_[direct_light_[i].slot] += direct_light_[i].light;
  }
}

}  // namespace solidtex::pathtracer
