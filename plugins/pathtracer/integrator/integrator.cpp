// Renders an image: tiles on oneTBB threads, in passes.
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "plugins/pathtracer/integrator/adaptive_sampling.h"
#include "plugins/pathtracer/integrator/checkpoint.h"
#include "plugins/pathtracer/integrator/tile.h"

namespace solidtex::pathtracer {
namespace {

void add(RenderStatistics& total, const RenderStatistics& tile) {
  total.ray_count += tile.ray_count;
  total.texture_point_count += tile.texture_point_count;
  total.invalid_sample_count += tile.invalid_sample_count;
  total.intersection_seconds += tile.intersection_seconds;
  total.texture_seconds += tile.texture_seconds;
  total.shading_seconds += tile.shading_seconds;
}

Window crop_of(const RenderSettings& settings) {
  return settings.crop.empty() ? Window{0, 0, settings.width, settings.height} : settings.crop;
}

void check(const RenderSettings& settings) {
  if (settings.width < 1 || settings.height < 1 || settings.samples < 1 || settings.max_depth < 1 ||
      settings.threads < 0) {
    throw std::invalid_argument(
        "render: width, height, samples and max_depth must be at least 1, threads at least 0");
  }
  const Window crop = crop_of(settings);
  if (crop.x0 < 0 || crop.y0 < 0 || crop.x1 > settings.width || crop.y1 > settings.height) {
    throw std::invalid_argument("render: the crop window must lie inside the image");
  }
  if (settings.aovs.empty())
    throw std::invalid_argument("render: found no AOV, expected at least one");
  if (!(settings.noise >= 0)) throw std::invalid_argument("render: noise must be at least 0");
}

// The crop window, with a noise target enlarged to whole blocks: all pixels of a block decide its
// sample count, and a crop must have the values of the full image.
Window rendered_window(const RenderSettings& settings) {
  Window window = crop_of(settings);
  if (settings.noise > 0) {
    window.x0 -= window.x0 % kBlockSize;
    window.y0 -= window.y0 % kBlockSize;
    window.x1 = std::min(settings.width, (window.x1 + kBlockSize - 1) / kBlockSize * kBlockSize);
    window.y1 = std::min(settings.height, (window.y1 + kBlockSize - 1) / kBlockSize * kBlockSize);
  }
  return window;
}

std::vector<Window> make_tiles(const Window& window) {
  std::vector<Window> tiles;
  for_each_square(window, kTileSize, [&](const Window& tile) { tiles.push_back(tile); });
  return tiles;
}

std::size_t thread_count(const RenderSettings& settings) {
  return settings.threads > 0 ? static_cast<std::size_t>(settings.threads)
                              : std::max(1u, std::thread::hardware_concurrency());
}

RenderSettings checked(const RenderSettings& settings) {
  check(settings);
  return settings;
}

}  // namespace

struct Renderer::State {
  State(const Scene& scene, const RenderSettings& settings)
      : context(scene, checked(settings)),
        tiles(make_tiles(rendered_window(settings))),
        framebuffer(rendered_window(settings), settings.aovs, settings.noise > 0) {}

  bool pass(std::uint32_t target, const Callbacks& callbacks);

  RenderContext context;
  std::vector<Window> tiles;
  Framebuffer framebuffer;
  RenderStatistics statistics;
};

// Renders all pixels up to `target` samples.
bool Renderer::State::pass(std::uint32_t target, const Callbacks& callbacks) {
  std::atomic<std::size_t> finished = 0;  // tiles
  // One renderer per thread, not per tile: allocating the paths of every tile took 5 % of a frame.
  tbb::enumerable_thread_specific<TileRenderer> renderers(
      [&] { return TileRenderer(context, framebuffer); });
  tbb::parallel_for(std::size_t{0}, tiles.size(), [&](std::size_t i) {
    // Isolated: a thread that waits for a parallel texture query must not start another tile.
    tbb::this_task_arena::isolate(
        [&] { finished += renderers.local().render(tiles[i], target, callbacks) ? 1 : 0; });
  });
  const bool is_complete = finished == tiles.size();  // read first: what the tiles wrote is seen
  for (const TileRenderer& renderer : renderers) add(statistics, renderer.statistics());
  return is_complete;
}

Renderer::Renderer(const Scene& scene, const RenderSettings& settings)
    : state_(std::make_unique<State>(scene, settings)) {}

Renderer::~Renderer() = default;

bool Renderer::render(const Callbacks& callbacks) {
  const RenderSettings& settings = state_->context.settings;
  const tbb::global_control allowed(tbb::global_control::max_allowed_parallelism,
                                    thread_count(settings));
  tbb::task_arena arena(static_cast<int>(thread_count(settings)));
  const auto samples = static_cast<std::uint32_t>(settings.samples);
  return arena.execute([&] {
    for (std::uint32_t target = settings.progressive ? 1 : samples; target < samples; target *= 2) {
      if (!state_->pass(target, callbacks)) return false;
    }
    return state_->pass(samples, callbacks);
  });
}

std::uint64_t Renderer::remaining_samples() const {
  return pathtracer::remaining_samples(state_->framebuffer, state_->context.settings,
                                       state_->framebuffer.window());
}

AovImage Renderer::image() const {
  const RenderSettings& settings = state_->context.settings;
  return state_->framebuffer.image(settings.width, settings.height, crop_of(settings));
}

RenderStatistics Renderer::statistics() const { return state_->statistics; }

void Renderer::save(const std::filesystem::path& checkpoint) const {
  write_checkpoint(checkpoint, identity_of(state_->context.scene, state_->context.settings),
                   state_->statistics, state_->framebuffer);
}

void Renderer::resume(const std::filesystem::path& checkpoint) {
  state_->statistics =
      read_checkpoint(checkpoint, identity_of(state_->context.scene, state_->context.settings),
                      state_->framebuffer);
}

Image render(const Scene& scene, const RenderSettings& settings, const Callbacks& callbacks,
             RenderStatistics* statistics) {
  Renderer renderer(scene, settings);
  if (!renderer.render(callbacks)) throw RenderStopped();
  if (statistics) *statistics = renderer.statistics();
  return beauty(renderer.image());
}

}  // namespace solidtex::pathtracer
