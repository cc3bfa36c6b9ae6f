// Wavefront path tracing of tiles: all paths of a tile advance one segment together, so that each
// solid texture gets one query per segment for many points.
#pragma once

#include <time.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "plugins/pathtracer/film/framebuffer.h"
#include "plugins/pathtracer/geometry/embree_scene.h"
#include "plugins/pathtracer/integrator/camera.h"
#include "plugins/pathtracer/lights/lights.h"
#include "plugins/pathtracer/materials/material_bsdf.h"
#include "plugins/pathtracer/materials/material_sample.h"
#include "plugins/pathtracer/sampling/sample_sequence.h"
#include "plugins/pathtracer/sampling/sampling.h"

namespace solidtex::pathtracer {

// Shared by all tiles; immutable while rendering.
struct RenderContext {
  RenderContext(const Scene& scene, const RenderSettings& settings);

  const Scene& scene;
  RenderSettings settings;
  EmbreeScene geometry;
  Lights lights;
  std::vector<MaterialBsdf> bsdfs;  // per material
  CameraRays camera;
  bool needs_paths, needs_first_hits, needs_cost;  // by the requested AOVs
};

// Processor time of the calling thread, which is independent of other load on the machine. About
// 200 ns a lap.
class Stopwatch {
 public:
  // Adds the time since the last lap, or since construction, to `total`.
  void lap(double& total) {
    const double now = seconds();
    total += now - last_;
    last_ = now;
  }

 private:
  static double seconds() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

  double last_ = seconds();
};

class TileRenderer {
 public:
  TileRenderer(const RenderContext& context, Framebuffer& framebuffer)
      : context_(context),
        framebuffer_(framebuffer),
        evaluate_materials_(context.scene, context.settings.texture_filter) {}

  // Takes samples until each pixel of the tile has `target` samples or is finished. Returns false
  // when a callback stops it; the framebuffer keeps the samples so far.
  bool render(const Window& tile, std::uint32_t target, const Callbacks& callbacks);
  // Of all tiles so far.
  const RenderStatistics& statistics() const { return statistics_; }

 private:
  struct Path {
    glm::vec3 throughput{1};
    float bsdf_pdf = 0;      // density of the last BSDF sample
    float eta_scale = 1;     // compression of radiance by refraction, already in the throughput
    std::uint32_t slot = 0;  // index in radiance_
    SampleSequence sequence;
  };

  // The contribution of a shadow ray that is not occluded.
  struct DirectLight {
    std::uint32_t slot;
    glm::vec3 radiance;
  };

  // For SamplePairs: sequences of paths, starting at the path `first`.
  auto sequence_of(std::size_t first) const {
    return [this, first](int i) -> const SampleSequence& {
      return paths_[first + static_cast<std::size_t>(i)].sequence;
    };
  }

  bool choose_pixels(std::uint32_t target);
  std::uint32_t batch_size(std::uint32_t target) const;
  void start_paths(std::uint32_t sample_count);
  void trace();
  void intersect(int depth);
  void add_environment(int depth);
  void process_hits(int depth);
  void record_aovs(int depth);
  void scatter(int depth);
  void sample_lights(int depth);
  void connect_light(const LightSample& light, const Path& path,
                     const SurfaceInteraction& interaction, const Bsdf& bsdf, const Frame& frame,
                     const glm::vec3& out);
  void add_unoccluded_light();
  bool sample_next_ray(Path& path, Ray& ray, const SurfaceInteraction& interaction,
                       const Bsdf& bsdf, const Frame& frame, const glm::vec3& out,
                       const glm::vec2& direction_u, int depth);
  void add_emission(const Path& path, const EmittedLight& light, int depth);
  void truncate_paths(std::size_t count);
  void accumulate(std::uint32_t sample_count);

  const RenderContext& context_;
  Window tile_;
  Framebuffer& framebuffer_;
  MaterialEvaluator evaluate_materials_;
  RenderStatistics statistics_;
  Stopwatch watch_;
  std::vector<glm::ivec2> pixels_;  // of this batch; all have the same number of samples:
  std::uint32_t first_sample_ = 0;
  // Per active path.
  std::vector<Path> paths_;
  std::vector<Ray> rays_;
  std::vector<Hit> hits_;
  std::vector<SurfaceInteraction> interactions_;
  std::vector<MaterialSample> material_samples_;
  std::vector<glm::vec3> light_origins_;  // points slightly above interactions_[i]
  std::vector<glm::vec2> light_u_;
  std::vector<LightSample> light_samples_;
  SamplePairs pairs_;  // of a batch of paths
  // Per shadow ray.
  std::vector<ShadowRay> shadow_rays_;
  std::vector<DirectLight> direct_light_;
  std::vector<std::uint8_t> occluded_;
  // Per pixel and sample of this batch; the last two only if AOVs need them.
  std::vector<glm::vec3> radiance_;
  std::vector<FirstHit> first_hits_;
  std::vector<std::uint32_t> costs_;
};

}  // namespace solidtex::pathtracer
