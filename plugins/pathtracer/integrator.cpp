// Tiles of the picture on oneTBB's threads.
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <mutex>
#include <thread>

#include "plugins/pathtracer/tile.h"

namespace solidtex::pathtracer {
namespace {

constexpr int kTileSize = 32;

std::vector<Tile> make_tiles(int width, int height) {
  std::vector<Tile> tiles;
  for (int y = 0; y < height; y += kTileSize) {
    for (int x = 0; x < width; x += kTileSize) {
      tiles.push_back({x, y, std::min(kTileSize, width - x), std::min(kTileSize, height - y)});
    }
  }
  return tiles;
}

void add(RenderStatistics& total, const RenderStatistics& tile) {
  total.ray_count += tile.ray_count;
  total.texture_point_count += tile.texture_point_count;
  total.invalid_sample_count += tile.invalid_sample_count;
}

void check(const RenderSettings& settings) {
  if (settings.width < 1 || settings.height < 1 || settings.samples < 1 || settings.max_depth < 1 ||
      settings.threads < 0) {
    throw std::invalid_argument(
        "render: width, height, samples and max_depth must be at least 1, threads at least 0");
  }
}

}  // namespace

Image render(const Scene& scene, const RenderSettings& settings, const Hooks& hooks,
             RenderStatistics* statistics) {
  check(settings);
  const int threads = settings.threads > 0
                          ? settings.threads
                          : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  const tbb::global_control allowed(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
  tbb::task_arena arena(threads);

  Image image{settings.width, settings.height, {}};
  image.rgb.resize(static_cast<std::size_t>(settings.width) *
                   static_cast<std::size_t>(settings.height) * 3);
  const std::vector<Tile> tiles = make_tiles(settings.width, settings.height);
  RenderStatistics total;
  std::mutex total_mutex;
  arena.execute([&] {
    const RenderContext context(scene, settings);
    tbb::parallel_for(std::size_t{0}, tiles.size(), [&](std::size_t i) {
      // Isolated: while a texture query waits for its own parallel parts, this thread must not
      // start another tile on top of this one.
      tbb::this_task_arena::isolate([&] {
        TileRenderer tile(context, tiles[i]);
        tile.render(image, hooks);
        const std::lock_guard lock(total_mutex);
        add(total, tile.statistics());
      });
    });
  });
  if (statistics) *statistics = total;
  return image;
}

}  // namespace solidtex::pathtracer
