#include "engine/lattice/lattice.h"

#include <algorithm>
#include <string>
#include <vector>

#include "engine/common/arena.h"
#include "engine/common/error.h"
#include "engine/lattice/evaluation.h"
#include "engine/noise/noise.h"

namespace solidtex::engine {

struct Lattice::Workspaces {
  ScratchMeter meter;
  PerThread<Workspace> of_thread;
};

namespace {

constexpr std::uint64_t kMaxPeriod = std::uint64_t{1} << 30;

// Each level must hold a whole number of voxels.
std::int64_t checked_period(const LatticeModel& model, std::uint64_t period) {
  int top = 0;
  for (const Node& node : model.nodes) top = std::max(top, node.level);
  const std::uint64_t pitch = std::uint64_t{1} << top;
  if (period > kMaxPeriod || period % pitch != 0)
    throw Error(SOLIDTEX_INVALID_ARGUMENT, "parameter \"period\" is " + std::to_string(period) +
                                               ", expected a multiple of " + std::to_string(pitch) +
                                               " texels up to 2^30 for this model, or 0 for none");
  return static_cast<std::int64_t>(period);
}

// The part of a box in one period along an axis: [begin, end), moved by `shift` into the first.
struct Stretch {
  std::int64_t begin, end, shift;
};

std::vector<Stretch> stretches(std::int64_t begin, std::int64_t end, std::int64_t period) {
  std::vector<Stretch> result;
  while (begin < end) {
    const std::int64_t in_first = (begin % period + period) % period;
    const std::int64_t next = std::min(end, begin + period - in_first);
    result.push_back({begin, next, in_first - begin});
    begin = next;
  }
  return result;
}

}  // namespace

Lattice::Lattice(LatticeModel model, NoiseScheme scheme, std::uint64_t seed, std::uint64_t period)
    : model_(std::move(model)),
      plan_(make_plan(model_)),
      scheme_(scheme),
      seed_(seed),
      period_(checked_period(model_, period)),
      workspaces_(std::make_unique<Workspaces>()) {
  for (const Node& node : model_.nodes)
    if (const auto* noise = std::get_if<NoiseOp>(&node.op))
      if (noise->distribution == Distribution::normal) require_normal(scheme_);
}

Lattice::Lattice(Lattice&&) noexcept = default;
Lattice::~Lattice() = default;

int Lattice::channels() const { return model_.nodes.back().channels; }

// Evaluates the parts of a box in the first period: the same voxel of two periods has the same
// tiles and so the same bits.
void Lattice::evaluate(const Box& box, const BoxTarget& target) const {
  if (period_ == 0) return run(box, target, 0);
  for (const Stretch& x : stretches(box.lo[0], box.hi[0], period_))
    for (const Stretch& y : stretches(box.lo[1], box.hi[1], period_))
      for (const Stretch& z : stretches(box.lo[2], box.hi[2], period_)) {
        const Box part{{x.begin + x.shift, y.begin + y.shift, z.begin + z.shift},
                       {x.end + x.shift, y.end + y.shift, z.end + z.shift}};
        BoxTarget corner = target;
        corner.data += (x.begin - box.lo[0]) * target.x_pitch +
                       (y.begin - box.lo[1]) * target.y_pitch + (z.begin - box.lo[2]) * channels();
        run(part, corner, period_);
      }
}

void Lattice::evaluate(const Box& box, float* values) const { evaluate(box, whole(box, values)); }

void Lattice::evaluate_endless(const Box& box, float* values) const {
  run(box, whole(box, values), 0);
}

BoxTarget Lattice::whole(const Box& box, float* values) const {
  const auto y_size = static_cast<std::ptrdiff_t>(box.size(1));
  const auto y_pitch = static_cast<std::ptrdiff_t>(box.size(2) * channels());
  return {values, y_size * y_pitch, y_pitch};
}

void Lattice::run(const Box& box, const BoxTarget& target, std::int64_t period) const {
  if (box.empty()) return;
  Evaluation(model_, plan_, scheme_, seed_, period)
      .run(box, target, workspaces_->of_thread.local(), workspaces_->meter);
}

ScratchMeter& Lattice::scratch() const { return workspaces_->meter; }

}  // namespace solidtex::engine
