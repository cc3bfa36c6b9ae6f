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

// What the tiles report, under one lock.
class Report {
 public:
  Report(std::size_t tile_count, const Progress& progress)
      : tile_count_(tile_count), progress_(progress) {}

  void add(const RenderStatistics& tile) {
    const std::lock_guard lock(mutex_);
    total_.ray_count += tile.ray_count;
    total_.texture_point_count += tile.texture_point_count;
    total_.invalid_sample_count += tile.invalid_sample_count;
    ++finished_;
    if (progress_) progress_(static_cast<double>(finished_) / static_cast<double>(tile_count_));
  }
  const RenderStatistics& total() const { return total_; }

 private:
  std::mutex mutex_;
  std::size_t tile_count_, finished_ = 0;
  const Progress& progress_;
  RenderStatistics total_;
};

void check(const RenderSettings& settings) {
  if (settings.width < 1 || settings.height < 1 || settings.samples < 1 || settings.max_depth < 1 ||
      settings.threads < 0) {
    throw std::invalid_argument(
        "render: width, height, samples and max_depth must be at least 1, threads at least 0");
  }
}

}  // namespace

Image render(const Scene& scene, const RenderSettings& settings, const Progress& progress,
             std::stop_token stop, RenderStatistics* statistics) {
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
  Report report(tiles.size(), progress);
  arena.execute([&] {
    const RenderContext context(scene, settings);
    tbb::parallel_for(std::size_t{0}, tiles.size(), [&](std::size_t i) {
      // Isolated: while a texture query waits for its own parallel parts, this thread must not
      // start another tile on top of this one.
      tbb::this_task_arena::isolate([&] {
        TileRenderer tile(context, tiles[i]);
        tile.render(image, stop);
        report.add(tile.statistics());
      });
    });
  });
  if (statistics) *statistics = report.total();
  return image;
}

}  // namespace solidtex::pathtracer
