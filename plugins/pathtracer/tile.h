// Wavefront path tracing of one tile: all its paths advance one segment together, so that each
// solid texture is asked once per segment for many points.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "plugins/pathtracer/appearance.h"
#include "plugins/pathtracer/camera.h"
#include "plugins/pathtracer/embree_scene.h"
#include "plugins/pathtracer/lights.h"
#include "plugins/pathtracer/material_bsdf.h"
#include "plugins/pathtracer/sampling.h"

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
};

struct Tile {
  int x = 0, y = 0, width = 0, height = 0;  // in pixels
};

class TileRenderer {
 public:
  TileRenderer(const RenderContext& context, const Tile& tile)
      : context_(context), tile_(tile), lookup_(context.scene, context.settings.texture_filter) {}

  // Writes the mean of all samples of the tile's pixels. Throws Stopped when asked to stop.
  void render(Image& image, const Hooks& hooks);
  const RenderStatistics& statistics() const { return statistics_; }

 private:
  struct Path {
    Ray ray;
    glm::vec3 throughput{1};
    float bsdf_pdf = 0;      // density with which the last bounce chose the ray
    float compression = 1;   // of radiance by refraction, which throughput is divided by
    std::uint32_t slot = 0;  // place in radiance_
    Sampler sampler;
  };

  void start_paths(int first_sample, int sample_count);
  void trace();
  void intersect(int depth);
  void scatter(int depth);
  void add_direct_light(const Path& path, const Surface& surface, const Bsdf& bsdf,
                        const Frame& frame, const glm::vec3& out, std::uint32_t dimension);
  bool bounce(Path& path, const Surface& surface, const Bsdf& bsdf, const Frame& frame,
              const glm::vec3& out, std::uint32_t dimension, int depth);
  void add_emitted(const Path& path, const LightSample& seen, int depth);
  void accumulate(int sample_count);

  const RenderContext& context_;
  Tile tile_;
  AppearanceLookup lookup_;
  RenderStatistics statistics_;
  std::vector<Path> paths_;          // still under way
  std::vector<Surface> surfaces_;    // where paths_[i] has arrived
  std::vector<Appearance> found_;    // what is there
  std::vector<glm::vec3> radiance_;  // per pixel and sample of this batch
  std::vector<glm::dvec3> pixel_sums_;
};

}  // namespace solidtex::pathtracer
