#include "plugins/pathtracer/tile.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "plugins/pathtracer/convergence.h"
#include "plugins/pathtracer/texel_space.h"

namespace solidtex::pathtracer {
namespace {

// Paths that advance together: enough to fill texture batches, few enough to stay in cache.
constexpr std::size_t kBatchPaths = 16384;

// Random numbers of one bounce, counted from dimension(depth).
enum Dimension : std::uint32_t { kLight, kLobe, kDirection, kRoulette, kCount };
constexpr std::uint32_t kPixel = 0, kLens = 1, kFirstBounce = 2;

std::uint32_t dimension(int depth) {
  return kFirstBounce + static_cast<std::uint32_t>(depth - 1) * kCount;
}

// Of stochastic filtering, far from the others, which therefore do not change with it.
constexpr std::uint32_t kJitter = 1u << 24;

constexpr int kRouletteDepth = 4;

// A place in the cube [-1, 1]^3.
glm::vec3 jitter(const Sampler& sampler, int depth) {
  const std::uint32_t dimension = kJitter + 2 * static_cast<std::uint32_t>(depth);
  const glm::vec2 xy = sampler.get_2d(dimension);
  return 2.0f * glm::vec3(xy.x, xy.y, sampler.get_1d(dimension + 1)) - 1.0f;
}

bool is_finite(const glm::vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

FirstHit first_hit(const Scene& scene, const CameraRays& camera, const Ray& ray,
                   const Surface& surface, const Appearance& found) {
  FirstHit hit{.albedo = found.color,
               .normal = bumped_normal(surface.normal, found.slope, -ray.direction),
               .position = surface.position,
               .depth = camera.depth_of(surface.position),
               .is_object = true};
  if (const SolidColor* solid = solid_texture_of(scene.materials[surface.material])) {
    const TexelSpace space(*solid);
    const TexelSpace::Point point = space(surface);
    hit.texcoord = glm::vec3(space.origin() + glm::dvec3(point.offset));
    hit.footprint = point.radius;
    hit.is_textured = true;
  }
  return hit;
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

// The unfinished pixels that have the fewest samples; false when there are none.
bool TileRenderer::choose_pixels(std::uint32_t target) {
  const RenderSettings& settings = context_.settings;
  pixels_.clear();
  for_each_square(tile_, part_size(settings), [&](const Window& part) {
    const std::uint32_t count = framebuffer_.sample_count(framebuffer_.pixel(part.x0, part.y0));
    if (count >= target || is_done(framebuffer_, settings, part)) return;
    if (!pixels_.empty() && count > first_sample_) return;
    if (count < first_sample_) pixels_.clear();
    first_sample_ = count;
    for (int y = part.y0; y < part.y1; ++y) {
      for (int x = part.x0; x < part.x1; ++x) pixels_.emplace_back(x, y);
    }
  });
  return !pixels_.empty();
}

std::uint32_t TileRenderer::batch_size(std::uint32_t target) const {
  const auto fitting =
      static_cast<std::uint32_t>(std::max<std::size_t>(1, kBatchPaths / pixels_.size()));
  return std::min(
      {fitting, target - first_sample_, samples_to_check(context_.settings, first_sample_)});
}

void TileRenderer::start_paths(std::uint32_t sample_count) {
  const RenderSettings& settings = context_.settings;
  paths_.clear();
  rays_.clear();
  for (const glm::ivec2& p : pixels_) {
    const auto pixel = static_cast<std::uint32_t>(p.y * settings.width + p.x);
    for (std::uint32_t s = 0; s < sample_count; ++s) {
      const Sampler sampler(settings.seed, pixel, first_sample_ + s);
      // A tent filter of two pixels' width, by placing the samples with its density.
      const glm::vec2 u = sampler.get_2d(kPixel);
      const Ray ray =
          context_.camera.ray(static_cast<float>(p.x) + 0.5f + sample_tent(u.x),
                              static_cast<float>(p.y) + 0.5f + sample_tent(u.y),
                              context_.camera.has_lens() ? sampler.get_2d(kLens) : glm::vec2(0));
      paths_.push_back({.slot = static_cast<std::uint32_t>(paths_.size()), .sampler = sampler});
      rays_.push_back(ray);
    }
  }
  radiance_.assign(paths_.size(), glm::vec3(0));
  if (context_.needs_first_hits) first_hits_.assign(paths_.size(), {});
  if (context_.needs_cost) costs_.assign(paths_.size(), 0);
  watch_.lap(statistics_.shading_seconds);
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

// Adds what the rays found glowing and keeps the paths that arrived at an object.
void TileRenderer::arrive(int depth) {
  surfaces_.clear();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < paths_.size(); ++i) {
    const Path& path = paths_[i];
    const Ray& ray = rays_[i];
    const Hit& hit = hits_[i];
    if (hit.kind == Hit::Kind::nothing) {
      add_emitted(path, context_.lights.environment_seen(ray.direction), depth);
    } else if (hit.kind == Hit::Kind::light) {
      add_emitted(path,
                  context_.lights.light_seen(
                      {hit.index, hit.triangle, ray.origin, ray.direction, hit.distance}),
                  depth);
    } else {
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

void TileRenderer::add_emitted(const Path& path, const LightSample& seen, int depth) {
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

// Keeps what layers other than the light need.
void TileRenderer::record(int depth) {
  if (context_.needs_cost) {
    for (std::size_t i = 0; i < paths_.size(); ++i) {
      const Material& material = context_.scene.materials[surfaces_[i].material];
      costs_[paths_[i].slot] += texture_points_of(material);
    }
  }
  if (depth > 1 || !context_.needs_first_hits) return;
  for (std::size_t i = 0; i < paths_.size(); ++i) {
    first_hits_[paths_[i].slot] =
        first_hit(context_.scene, context_.camera, rays_[i], surfaces_[i], found_[i]);
  }
}

// A light for each path, all at once because that is faster.
void TileRenderer::choose_lights(int depth) {
  lights_.assign(paths_.size(), {});
  if (context_.settings.light_sampling == LightSampling::bsdf || context_.lights.empty()) return;
  above_.clear();
  light_numbers_.clear();
  for (std::size_t i = 0; i < paths_.size(); ++i) {
    above_.push_back(context_.geometry.leave(surfaces_[i], surfaces_[i].geometric_normal));
    light_numbers_.push_back(paths_[i].sampler.get_2d(dimension(depth) + kLight));
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
  for (std::size_t i = 0; i < paths_.size(); ++i) {
    Path path = paths_[i];
    Ray ray = rays_[i];
    const Surface& surface = surfaces_[i];
    const Bsdf bsdf = context_.bsdfs[surface.material].at(found_[i], surface.inside, coat);
    const Frame frame(bumped_normal(surface.normal, found_[i].slope, -ray.direction));
    const glm::vec3 out = frame.to_local(-ray.direction);
    if (lights_[i].pdf > 0) aim_at(lights_[i], path, surface, bsdf, frame, out);
    if (!bounce(path, ray, surface, bsdf, frame, out, dimension(depth), depth)) continue;
    rays_[kept] = ray;
    paths_[kept++] = path;
  }
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

void TileRenderer::add_unshadowed_light() {
  statistics_.ray_count += shadow_rays_.size();
  is_shadowed_.resize(shadow_rays_.size());
  context_.geometry.occluded(shadow_rays_, is_shadowed_);
  for (std::size_t i = 0; i < shadow_rays_.size(); ++i) {
    if (!is_shadowed_[i]) radiance_[direct_light_[i].slot] += direct_light_[i].light;
  }
}

// Chooses the next ray; false when the path ends.
bool TileRenderer::bounce(Path& path, Ray& ray, const Surface& surface, const Bsdf& bsdf,
                          const Frame& frame, const glm::vec3& out, std::uint32_t dimension,
                          int depth) {
  const BsdfSample next = bsdf.sample(out, path.sampler.get_1d(dimension + kLobe),
                                      path.sampler.get_2d(dimension + kDirection));
  if (next.pdf <= 0) return false;
  const glm::vec3 direction = glm::normalize(frame.to_world(next.direction));
  if (glm::dot(direction, surface.geometric_normal) * next.direction.z <= 0) return false;
  path.throughput *= next.weight;
  path.compression *= next.ior * next.ior;
  const float brightest = std::max({path.throughput.x, path.throughput.y, path.throughput.z});
  if (brightest <= 0) return false;
  if (depth >= kRouletteDepth) {
    const float survival = std::min(brightest * path.compression, 0.95f);
    if (path.sampler.get_1d(dimension + kRoulette) >= survival) return false;
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

void TileRenderer::accumulate(std::uint32_t sample_count) {
  for (std::size_t slot = 0; slot < radiance_.size(); ++slot) {
    const glm::ivec2 p = pixels_[slot / sample_count];
    const std::size_t pixel = framebuffer_.pixel(p.x, p.y);
    if (is_finite(radiance_[slot])) {
      framebuffer_.add_light(pixel, radiance_[slot]);
    } else {
      ++statistics_.invalid_sample_count;
    }
    if (context_.needs_first_hits) framebuffer_.add_first_hit(pixel, first_hits_[slot]);
    if (context_.needs_cost) framebuffer_.add_cost(pixel, costs_[slot]);
    framebuffer_.count_samples(pixel, 1);
  }
  watch_.lap(statistics_.shading_seconds);
}

}  // namespace solidtex::pathtracer
