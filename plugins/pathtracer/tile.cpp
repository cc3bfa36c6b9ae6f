#include "plugins/pathtracer/tile.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace solidtex::pathtracer {
namespace {

// Paths that advance together: enough to fill texture batches, few enough to stay in cache.
constexpr int kBatchPaths = 16384;

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

}  // namespace

RenderContext::RenderContext(const Scene& scene_, const RenderSettings& settings_)
    : scene(scene_),
      settings(settings_),
      geometry(scene_),
      lights(scene_),
      camera(scene_.camera, settings_.width, settings_.height, settings_.samples) {
  for (const Material& material : scene.materials) {
    bsdfs.emplace_back(material);
  }
}

void TileRenderer::render(Image& image, const Hooks& hooks) {
  const int pixel_count = tile_.width * tile_.height;
  const int samples = context_.settings.samples;
  const int batch = std::clamp(kBatchPaths / pixel_count, 1, samples);
  pixel_sums_.assign(static_cast<std::size_t>(pixel_count), glm::dvec3(0));
  for (int first = 0; first < samples; first += batch) {
    if (hooks.should_stop && hooks.should_stop()) throw Stopped();
    const int count = std::min(batch, samples - first);
    start_paths(first, count);
    trace();
    accumulate(count);
    if (hooks.on_samples)
      hooks.on_samples(static_cast<std::uint64_t>(pixel_count) * static_cast<std::uint64_t>(count));
  }
  for (int i = 0; i < pixel_count; ++i) {
    const int x = tile_.x + i % tile_.width, y = tile_.y + i / tile_.width;
    const auto pixel = (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                        static_cast<std::size_t>(x)) *
                       3;
    const glm::dvec3 mean = pixel_sums_[static_cast<std::size_t>(i)] / static_cast<double>(samples);
    for (int c = 0; c < 3; ++c) {
      image.rgb[pixel + static_cast<std::size_t>(c)] = static_cast<float>(mean[c]);
    }
  }
}

void TileRenderer::start_paths(int first_sample, int sample_count) {
  const RenderSettings& settings = context_.settings;
  paths_.clear();
  for (int i = 0; i < tile_.width * tile_.height; ++i) {
    const int x = tile_.x + i % tile_.width, y = tile_.y + i / tile_.width;
    const auto pixel = static_cast<std::uint32_t>(y * settings.width + x);
    for (int s = 0; s < sample_count; ++s) {
      const Sampler sampler(settings.seed, pixel, static_cast<std::uint32_t>(first_sample + s));
      // A tent filter of two pixels' width, by placing the samples with its density.
      const glm::vec2 u = sampler.get_2d(kPixel);
      const Ray ray = context_.camera.ray(static_cast<float>(x) + 0.5f + sample_tent(u.x),
                                          static_cast<float>(y) + 0.5f + sample_tent(u.y),
                                          sampler.get_2d(kLens));
      paths_.push_back(
          {.ray = ray, .slot = static_cast<std::uint32_t>(paths_.size()), .sampler = sampler});
    }
  }
  radiance_.assign(paths_.size(), glm::vec3(0));
}

void TileRenderer::trace() {
  for (int depth = 1; depth <= context_.settings.max_depth && !paths_.empty(); ++depth) {
    intersect(depth);
    if (depth == context_.settings.max_depth) return;
    found_.resize(surfaces_.size());
    statistics_.texture_point_count += lookup_(surfaces_, found_);
    scatter(depth);
  }
}

// Adds what the rays find glowing and keeps the paths that arrived at an object.
void TileRenderer::intersect(int depth) {
  statistics_.ray_count += paths_.size();
  surfaces_.clear();
  std::size_t kept = 0;
  for (const Path& path : paths_) {
    const Hit hit = context_.geometry.intersect(path.ray);
    if (hit.kind == Hit::Kind::nothing) {
      add_emitted(path, context_.lights.environment_seen(path.ray.direction), depth);
    } else if (hit.kind == Hit::Kind::light) {
      add_emitted(path,
                  context_.lights.light_seen(
                      {hit.index, hit.triangle, path.ray.origin, path.ray.direction, hit.distance}),
                  depth);
    } else {
      surfaces_.push_back(context_.geometry.surface(path.ray, hit));
      if (context_.settings.texture_filter == TextureFilter::stochastic) {
        surfaces_.back().jitter = jitter(path.sampler, depth);
      }
      radiance_[path.slot] +=
          path.throughput * context_.scene.materials[surfaces_.back().material].emission;
      paths_[kept++] = path;
    }
  }
  paths_.erase(paths_.begin() + static_cast<std::ptrdiff_t>(kept), paths_.end());
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

// Adds direct light and sends the paths on.
void TileRenderer::scatter(int depth) {
  std::size_t kept = 0;
  std::optional<Coat> coat;
  for (std::size_t i = 0; i < paths_.size(); ++i) {
    Path path = paths_[i];
    const Surface& surface = surfaces_[i];
    const Bsdf bsdf = context_.bsdfs[surface.material].at(found_[i], surface.inside, coat);
    const Frame frame(bumped_normal(surface.normal, found_[i].slope, -path.ray.direction));
    const glm::vec3 out = frame.to_local(-path.ray.direction);
    if (context_.settings.light_sampling != LightSampling::bsdf && !context_.lights.empty()) {
      add_direct_light(path, surface, bsdf, frame, out, dimension(depth));
    }
    if (bounce(path, surface, bsdf, frame, out, dimension(depth), depth)) paths_[kept++] = path;
  }
  paths_.erase(paths_.begin() + static_cast<std::ptrdiff_t>(kept), paths_.end());
}

void TileRenderer::add_direct_light(const Path& path, const Surface& surface, const Bsdf& bsdf,
                                    const Frame& frame, const glm::vec3& out,
                                    std::uint32_t dimension) {
  const glm::vec3 above = context_.geometry.leave(surface, surface.geometric_normal);
  const LightSample light = context_.lights.sample(above, path.sampler.get_2d(dimension + kLight));
  if (light.pdf <= 0) return;
  const glm::vec3 in = frame.to_local(light.direction);
  const float cosine = glm::dot(light.direction, surface.geometric_normal);
  if (cosine * in.z <= 0) return;
  const glm::vec3 reflected = bsdf.eval(out, in);
  if (reflected == glm::vec3(0)) return;
  ++statistics_.ray_count;
  const glm::vec3 origin = cosine > 0 ? above : context_.geometry.leave(surface, light.direction);
  // Just short of the light itself.
  if (context_.geometry.occluded({origin, light.direction}, light.distance * 0.9999f)) return;
  const float weight = context_.settings.light_sampling == LightSampling::mis
                           ? power_heuristic(light.pdf, bsdf.pdf(out, in))
                           : 1.0f;
  radiance_[path.slot] += path.throughput * reflected * light.radiance * (weight / light.pdf);
}

// Chooses the next ray; false when the path ends.
bool TileRenderer::bounce(Path& path, const Surface& surface, const Bsdf& bsdf, const Frame& frame,
                          const glm::vec3& out, std::uint32_t dimension, int depth) {
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
  const float spread = path.ray.spread;
  path.ray = {.origin = context_.geometry.leave(surface, direction), .direction = direction};
  if (next.alpha >= 0) {
    // A reflected or refracted cone, wider by this sample's share of what the surface scatters.
    // After a diffuse bounce there is none: many directions average what they find.
    const float share = 1 / std::sqrt(static_cast<float>(context_.settings.samples));
    path.ray.radius = surface.footprint;
    path.ray.spread = spread / next.ior + 0.5f * next.alpha * share;
  }
  path.bsdf_pdf = next.pdf;
  return true;
}

void TileRenderer::accumulate(int sample_count) {
  for (std::size_t i = 0; i < radiance_.size(); ++i) {
    if (is_finite(radiance_[i])) {
      pixel_sums_[i / static_cast<std::size_t>(sample_count)] += glm::dvec3(radiance_[i]);
    } else {
      ++statistics_.invalid_sample_count;
    }
  }
}

}  // namespace solidtex::pathtracer
