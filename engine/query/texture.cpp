#include "engine/query/texture.h"

#include <array>
#include <atomic>
#include <string>
#include <utility>

#include "engine/common/error.h"
#include "engine/common/parallel.h"
#include "engine/query/family.h"

namespace solidtex::engine {
namespace {

std::unique_ptr<Family> make_family(Model& model, std::uint64_t seed,
                                    std::uint64_t cache_limit_bytes, Precision precision,
                                    std::uint64_t period) {
  LightChannels light(model.channels, model.color_space);
  if (auto* lattice = std::get_if<LatticeModel>(&model.architecture)) {
    return make_lattice_family(Lattice(std::move(*lattice), model.noise_scheme, seed, period),
                               std::move(light), cache_limit_bytes);
  }
  if (period > 0)
    throw Error(SOLIDTEX_INVALID_ARGUMENT,
                "parameter \"period\" is " + std::to_string(period) +
                    ", expected 0 for a model of the sampler family: its octaves have no common "
                    "period. Choose a model of the lattice family");
  return make_sampler_family(
      Sampler(std::get<SamplerModel>(model.architecture), model.noise_scheme, seed, precision),
      std::move(light));
}

// Counters of points and voxels. Threads are spread over several cache lines, so that queries of
// single points do not contend.
class QueryCounters {
 public:
  struct alignas(64) Counters {
    std::atomic<std::uint64_t> points = 0, voxels = 0;
  };

  Counters& of_this_thread() const {
    static std::atomic<std::size_t> threads = 0;
    thread_local const std::size_t number = threads++;
    return counters_[number % counters_.size()];
  }

  QueryCounts total() const {
    QueryCounts sum;
    for (const Counters& counters : counters_)
      sum.points += counters.points, sum.voxels += counters.voxels;
    return sum;
  }

 private:
  mutable std::array<Counters, 32> counters_;
};

}  // namespace

struct Texture::Impl {
  Model model;
  std::unique_ptr<Family> family;
  std::unique_ptr<Arena> arena;  // null for the calling thread's
  QueryCounters counters;

  std::size_t channels() const { return model.channels.size(); }

  // Runs a query in the default floating-point environment. If the arena of the texture is full
  // another thread may run it, with the same progress range.
  template <class Call>
  void run(const Call& call) const {
    const auto here = [&] {
      const DefaultFloatMode mode;
      call();
    };
    if (!arena) return here();
    const ProgressScope::Range progress = ProgressScope::of_this_thread();
    run_in(*arena, [&] {
      const ProgressScope same(progress);
      here();
    });
  }
};

Texture::Texture(Model model, std::uint64_t seed, std::uint64_t cache_limit_bytes,
                 Precision precision, int threads, std::uint64_t period)
    : impl_(std::make_unique<Impl>()) {
  impl_->model = std::move(model);
  impl_->family = make_family(impl_->model, seed, cache_limit_bytes, precision, period);
  if (threads > 0) impl_->arena = std::make_unique<Arena>(threads);
}

Texture::~Texture() = default;

const Model& Texture::model() const { return impl_->model; }

void Texture::eval(const double origin[3], const float* points, const Footprints& footprints,
                   std::size_t count, const OutputView& output) const {
  impl_->run([&] {
    const PointBatch batch{{origin[0], origin[1], origin[2]}, points, count};
    check_points(batch, impl_->channels() * (output.jacobians ? 3 : 1));
    if (footprints.radii) check_radii(footprints.radii, count);
    if (footprints.axes) check_axes(footprints.axes, count);
    impl_->family->eval(batch, footprints, output);
  });
  impl_->counters.of_this_thread().points.fetch_add(count, std::memory_order_relaxed);
}

void Texture::eval_box(const std::int64_t origin[3], const std::int64_t size[3],
                       float* values) const {
  Box box;
  impl_->run([&] {
    box = checked_box(origin, size, impl_->channels());
    if (!box.empty()) impl_->family->eval_box(box, values);
  });
  if (box.empty()) return;
  const auto voxels = static_cast<std::uint64_t>(box.size(0) * box.size(1) * box.size(2));
  impl_->counters.of_this_thread().voxels.fetch_add(voxels, std::memory_order_relaxed);
}

CacheStats Texture::cache_stats() const { return impl_->family->cache_stats(); }

const ScratchMeter& Texture::scratch() const { return impl_->family->scratch(); }

QueryCounts Texture::query_counts() const { return impl_->counters.total(); }

}  // namespace solidtex::engine
