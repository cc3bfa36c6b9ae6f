// solidtex_openimageio_rate [MODEL] [EDGE]: what evaluation through OpenImageIO costs beside direct
// calls, and what its levels of detail cost: the tables of docs/experiments/host-overhead.md. MODEL
// is granite-grey and the volume has 256 texels along an edge unless named. Processor time, of all
// threads together, the best of three.
#include <OpenImageIO/Imath.h>
#include <OpenImageIO/imagecache.h>
#include <OpenImageIO/texture.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <functional>
#include <limits>
#include <memory>
#include <solidtex/solidtex.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

constexpr int kRounds = 3;
constexpr std::size_t kBatch = 4096;  // points of a direct call

struct SystemCloser {
  void operator()(OIIO::TextureSystem* system) const { OIIO::TextureSystem::destroy(system); }
};
using System = std::unique_ptr<OIIO::TextureSystem, SystemCloser>;

void check(bool is_good, const std::string& message) {
  if (!is_good) throw std::runtime_error(message);
}

double processor_seconds(const std::function<void()>& work) {
  const auto now = [] {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  };
  const double begin = now();
  work();
  return now() - begin;
}

// A tilted plane through the volume, its points nearly a texel apart, as a camera meets them.
std::vector<float> plane(int edge) {
  std::vector<float> points;
  for (int u = 1; u < edge - 1; ++u)
    for (int v = 1; v < edge - 1; ++v) {
      const auto x = static_cast<float>(u), y = static_cast<float>(v);
      points.insert(points.end(), {x, y * 0.8f, (x + 2 * y) * 0.3f});
    }
  return points;
}

// One volume of one seed, so that nothing is computed before; both sides.
class Round {
 public:
  Round(const std::string& model, int edge, unsigned seed)
      : edge_(edge),
        points_(plane(edge)),
        texture_(model, {.seed = seed}),
        name_(model + ".solidtex?lod=0&size=" + std::to_string(edge) +
              "&seed=" + std::to_string(seed)),
        system_(OIIO::TextureSystem::create(false)) {
    system_->attribute("max_memory_MB", 4096.0f);
  }

  std::size_t point_count() const { return points_.size() / 3; }
  std::size_t block_edge() const { return static_cast<std::size_t>(edge_) / 2; }

  void direct_points() const {
    std::vector<float> values(kBatch * texture_.channel_count());
    for (std::size_t begin = 0; begin < point_count(); begin += kBatch) {
      const std::size_t count = std::min(kBatch, point_count() - begin);
      texture_.eval_points({}, std::span(&points_[3 * begin], 3 * count),
                           std::span(values.data(), count * texture_.channel_count()));
    }
  }

  void host_points() const {
    const auto channels = static_cast<int>(texture_.channel_count());
    std::vector<float> value(texture_.channel_count());
    auto* handle = system_->get_texture_handle(name_);
    const Imath::V3f none(0, 0, 0);
    for (std::size_t i = 0; i < points_.size(); i += 3) {
      OIIO::TextureOpt options;
      check(system_->texture3d(handle, system_->get_perthread_info(), options,
                               {points_[i], points_[i + 1], points_[i + 2]}, none, none, none,
                               channels, value.data()),
            system_->geterror());
    }
  }

  void direct_block() const {
    const auto edge = static_cast<std::int64_t>(block_edge());
    std::vector<float> values(block_edge() * block_edge() * block_edge() *
                              texture_.channel_count());
    texture_.eval_box({0, 0, 0}, {edge, edge, edge}, values);
  }

  void host_block() const {
    const int edge = static_cast<int>(block_edge());
    std::vector<float> values(block_edge() * block_edge() * block_edge() *
                              texture_.channel_count());
    const std::unique_ptr<OIIO::ImageCache, void (*)(OIIO::ImageCache*)> cache(
        OIIO::ImageCache::create(false),
        [](OIIO::ImageCache* used) { OIIO::ImageCache::destroy(used); });
    check(cache->get_pixels(name_, 0, 0, 0, edge, 0, edge, 0, edge, OIIO::TypeFloat, values.data()),
          cache->geterror());
  }

 private:
  int edge_;
  std::vector<float> points_;
  solidtex::texture texture_;
  OIIO::ustring name_;
  System system_;
};

struct Line {
  const char* name;
  void (Round::*direct)() const;
  void (Round::*host)() const;
  bool is_block;
};

void compare(const std::string& model, int edge) {
  const Line lines[] = {{"points seen first", &Round::direct_points, &Round::host_points, false},
                        {"points seen again", &Round::direct_points, &Round::host_points, false},
                        {"voxels of a block", &Round::direct_block, &Round::host_block, true}};
  constexpr std::size_t kLines = std::size(lines);
  double best[kLines][2], counts[kLines];
  for (auto& pair : best) pair[0] = pair[1] = std::numeric_limits<double>::infinity();
  for (unsigned seed = 0; seed < kRounds; ++seed) {
    const Round round(model, edge, seed);
    for (std::size_t i = 0; i < kLines; ++i) {
      const double block = static_cast<double>(round.block_edge());
      counts[i] =
          lines[i].is_block ? block * block * block : static_cast<double>(round.point_count());
      const double direct = processor_seconds([&] { (round.*lines[i].direct)(); });
      const double host = processor_seconds([&] { (round.*lines[i].host)(); });
      best[i][0] = std::min(best[i][0], direct);
      best[i][1] = std::min(best[i][1], host);
    }
  }
  std::printf(
      "| %s, million a second | direct | through OpenImageIO | ratio |\n|---|---|---|---|\n",
      model.c_str());
  for (std::size_t i = 0; i < kLines; ++i) {
    std::printf("| %s | %.3g | %.3g | %.2f |\n", lines[i].name, 1e-6 * counts[i] / best[i][0],
                1e-6 * counts[i] / best[i][1], best[i][0] / best[i][1]);
  }
}

// The voxels of a level in a cube of texels that has not been read.
double level_seconds(const std::string& model, unsigned seed, int lod, int texels) {
  const std::string name = model + ".solidtex?type=float&size=" + std::to_string(2 * texels) +
                           "&seed=" + std::to_string(seed) + "&lod=" + std::to_string(lod);
  const auto input = OIIO::ImageInput::open(name);
  check(input != nullptr, OIIO::geterror());
  const OIIO::ImageSpec spec = input->spec_dimensions(0, 0);
  std::vector<float> values(spec.image_pixels() * static_cast<std::size_t>(spec.nchannels));
  const auto read = [&](int low, int high) {
    check(input->read_tiles(0, 0, low, high, low, high, low, high, 0, spec.nchannels,
                            OIIO::TypeFloat, values.data()),
          input->geterror());
  };
  read(spec.width - spec.tile_width, spec.width);  // elsewhere: measures the material
  return processor_seconds([&] { read(0, spec.width / 2); });
}

void level_costs(const std::string& model) {
  constexpr int kEdge = 128, kLevels = 6;
  double best[kLevels];
  std::fill_n(best, kLevels, std::numeric_limits<double>::infinity());
  for (unsigned seed = 0; seed < kRounds; ++seed) {
    for (int lod = 0; lod < kLevels; ++lod) {
      best[lod] = std::min(best[lod], level_seconds(model, seed, lod, kEdge));
    }
  }
  std::printf(
      "\n| %s | a voxel, microseconds | its texels at level 0, microseconds |\n|---|---|---|\n",
      model.c_str());
  for (int lod = 0; lod < kLevels; ++lod) {
    const double texels = static_cast<double>(kEdge) * kEdge * kEdge;
    const double texels_a_voxel = static_cast<double>(1 << 3 * lod);
    std::printf("| level %d | %.3g | %.3g |\n", lod, 1e6 * best[lod] / texels * texels_a_voxel,
                1e6 * best[0] / texels * texels_a_voxel);
  }
}

}  // namespace

int main(int argc, char** argv) try {
  const std::string model = argc > 1 ? argv[1] : "granite-grey";
  const int edge = argc > 2 ? std::atoi(argv[2]) : 256;
  check(edge >= 32 && edge <= 4096, "the edge is 32 to 4096 texels");
  OIIO::attribute("plugin_searchpath", SOLIDTEX_PLUGINS);
  compare(model, edge);
  level_costs(model);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "error: %s\n", error.what());
  return 1;
}
