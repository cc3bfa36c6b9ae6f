// Wavefront path tracing of one tile after another: all paths of a tile advance one segment
// together, so that each solid texture is asked once per segment for many points.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "plugins/pathtracer/film/framebuffer.h"
#include "plugins/pathtracer/geometry/embree_scene.h"
#include "plugins/pathtracer/integrator/camera.h"
#include "plugins/pathtracer/integrator/stopwatch.h"
#include "plugins/pathtracer/lights/lights.h"
#include "plugins/pathtracer/materials/appearance.h"
#include "plugins/pathtracer/materials/material_bsdf.h"
#include "plugins/pathtracer/sampling/numbers.h"
#include "plugins/pathtracer/sampling/sampling.h"

namespace solidtex::pathtracer {

// Everything that all tiles share; immutable while rendering.
struct RenderContext {
  RenderContext(const Scene& scene, const RenderSettings& settings);

  const Scene& scene;
  RenderSettings settings;
  EmbreeScene geometry;
  Lights lights;
  std::vector<MaterialBsdf> bsdfs;  // per material
  CameraRays camera;
  bool needs_paths, needs_first_hits, needs_cost;  // by the layers that are asked for
};

class TileRenderer {
 public:
  TileRenderer(const RenderContext& context, Framebuffer& framebuffer)
      : context_(context),
        framebuffer_(framebuffer),
        lookup_(context.scene, context.settings.texture_filter) {}

  // Takes samples until each pixel of the tile has `target` of them, or as many as it needs. False
  // when asked to stop; what is done until then is in the framebuffer.
  bool render(const Window& tile, std::uint32_t target, const Hooks& hooks);
  // Of all tiles until now.
  const RenderStatistics& statistics() const { return statistics_; }

 private:
  struct Path {
    glm::vec3 throughput{1};
    float bsdf_pdf = 0;      // density with which the last bounce chose the ray
    float compression = 1;   // of radiance by refraction, which throughput is divided by
    std::uint32_t slot = 0;  // place in radiance_
    Sampler sampler;
  };

  // What a shadow ray brings to a path's radiance, unless something stands in between.
  struct DirectLight {
    std::uint32_t slot;
    glm::vec3 light;
  };

  // For NumberPairs: from the path `first`.
  auto sampler_of(std::size_t first) const {
    return [this, first](int i) -> const Sampler& {
      return paths_[first + static_cast<std::size_t>(i)].sampler;
    };
  }

  bool choose_pixels(std::uint32_t target);
  std::uint32_t batch_size(std::uint32_t target) const;
  void start_paths(std::uint32_t sample_count);
  void trace();
  void intersect(int depth);
  void escape(int depth);
  void arrive(int depth);
  void record(int depth);
  void scatter(int depth);
  void choose_lights(int depth);
  void aim_at(const LightSample& light, const Path& path, const Surface& surface, const Bsdf& bsdf,
              const Frame& frame, const glm::vec3& out);
  void add_unshadowed_light();
  bool bounce(Path& path, Ray& ray, const Surface& surface, const Bsdf& bsdf, const Frame& frame,
              const glm::vec3& out, const glm::vec2& direction_numbers, int depth);
  void add_emitted(const Path& path, const SeenLight& seen, int depth);
  void keep(std::size_t count);
  void accumulate(std::uint32_t sample_count);

  const RenderContext& context_;
  Window tile_;
  Framebuffer& framebuffer_;
  AppearanceLookup lookup_;
  RenderStatistics statistics_;
  Stopwatch watch_;
  std::vector<glm::ivec2> pixels_;  // that this batch is for; all have this many samples:
  std::uint32_t first_sample_ = 0;
  std::vector<Path> paths_;               // still under way
  std::vector<Ray> rays_;                 // of paths_[i]
  std::vector<Hit> hits_;                 // what it has met
  std::vector<Surface> surfaces_;         // where paths_[i] has arrived
  std::vector<Appearance> found_;         // what is there
  std::vector<glm::vec3> above_;          // points just above surfaces_[i]
  std::vector<glm::vec2> light_numbers_;  // random ones, the same
  NumberPairs numbers_;                   // of some paths
  std::vector<LightSample> lights_;       // that they chose
  std::vector<ShadowRay> shadow_rays_;
  std::vector<DirectLight> direct_light_;  // of shadow_rays_[i]
  std::vector<std::uint8_t> is_shadowed_;  // the same
  std::vector<glm::vec3> radiance_;        // per pixel and sample of this batch
  std::vector<FirstHit> first_hits_;       // the same, where layers need it
  std::vector<std::uint32_t> costs_;       // the same
};

}  // namespace solidtex::pathtracer
