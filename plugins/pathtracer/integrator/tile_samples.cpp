// Starts a tile's samples and accumulates their results.
#include <algorithm>
#include <cmath>

#include "plugins/pathtracer/integrator/adaptive_sampling.h"
#include "plugins/pathtracer/integrator/tile.h"
#include "plugins/pathtracer/materials/texel_space.h"
#include "plugins/pathtracer/sampling/vectorized.h"

namespace solidtex::pathtracer {
namespace {

// Paths that advance together: enough to fill texture batches, few enough to stay in cache.
constexpr std::size_t kBatchPaths = 16384;

bool is_finite(const glm::vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

FirstHit first_hit(const Scene& scene, const CameraRays& camera, const Ray& ray,
                   const SurfaceInteraction& interaction, const MaterialSample& sample) {
  FirstHit hit{.albedo = sample.color,
               .normal = bumped_normal(interaction.normal, sample.height_gradient, -ray.direction),
               .position = glm::vec3(scene.origin + glm::dvec3(interaction.position)),
               .depth = camera.depth_of(interaction.position),
               .is_object = true};
  if (const SolidColor* solid = solid_texture_of(scene.materials[interaction.material])) {
    const TexelSpace space(*solid, position_origin(scene, *solid, interaction.object));
    const TexelSpace::Point point = space(interaction);
    hit.texcoord = glm::vec3(space.origin() + glm::dvec3(point.offset));
    hit.footprint = point.radius;
    hit.is_textured = true;
  }
  return hit;
}

}  // namespace

// Selects the unfinished pixels with the fewest samples. Returns false if there are none.
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
  const std::size_t count = pixels_.size() * sample_count;
  paths_.resize(count);
  rays_.resize(count);
  std::uint32_t slot = 0;
  for (const glm::ivec2& p : pixels_) {
    const SampleSequence sequence(settings.seed,
                                  static_cast<std::uint32_t>(p.y * settings.width + p.x), 0);
    for (std::uint32_t s = 0; s < sample_count; ++s, ++slot) {
      paths_[slot] = {.slot = slot, .sequence = sequence.of_sample(first_sample_ + s)};
    }
  }
  for_each_batch(count, [&](std::size_t first, int batch) {
    pairs_.draw(batch, kPixel, sequence_of(first));
    for (int i = 0; i < batch; ++i) {
      const std::size_t path = first + static_cast<std::size_t>(i);
      const glm::vec2 p = glm::vec2(pixels_[paths_[path].slot / sample_count]) + 0.5f;
      // Importance-samples a tent filter two pixels wide.
      rays_[path] = context_.camera.ray(
          p.x + sample_tent(pairs_.x[i]), p.y + sample_tent(pairs_.y[i]),
          context_.camera.has_lens() ? paths_[path].sequence.get_2d(kLens) : glm::vec2(0));
    }
  });
  radiance_.assign(paths_.size(), glm::vec3(0));
  if (context_.needs_first_hits) first_hits_.assign(paths_.size(), {});
  if (context_.needs_cost) costs_.assign(paths_.size(), 0);
  watch_.lap(statistics_.shading_seconds);
}

// Records the AOVs that do not need radiance.
void TileRenderer::record_aovs(int depth) {
  if (context_.needs_cost) {
    for (std::size_t i = 0; i < paths_.size(); ++i) {
      costs_[paths_[i].slot] += material_samples_[i].texture_points;
    }
  }
  if (depth > 1 || !context_.needs_first_hits) return;
  for (std::size_t i = 0; i < paths_.size(); ++i) {
    first_hits_[paths_[i].slot] = first_hit(context_.scene, context_.camera, rays_[i],
                                            interactions_[i], material_samples_[i]);
  }
}

void TileRenderer::accumulate(std::uint32_t sample_count) {
  for (std::size_t slot = 0; slot < radiance_.size(); ++slot) {
    const glm::ivec2 p = pixels_[slot / sample_count];
    const std::size_t pixel = framebuffer_.pixel(p.x, p.y);
    if (is_finite(radiance_[slot])) {
      framebuffer_.add_radiance(pixel, radiance_[slot]);
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
