#include "engine/lattice/lattice.h"

#include <tbb/enumerable_thread_specific.h>

#include "engine/lattice/evaluation.h"
#include "engine/noise/noise.h"

namespace solidtex::engine {

struct Lattice::Workspaces {
  tbb::enumerable_thread_specific<Workspace> of_thread;
};

Lattice::Lattice(LatticeModel model, NoiseScheme scheme, std::uint64_t seed)
    : model_(std::move(model)),
      plan_(make_plan(model_)),
      scheme_(scheme),
      seed_(seed),
      workspaces_(std::make_unique<Workspaces>()) {
  for (const Node& node : model_.nodes)
    if (const auto* noise = std::get_if<NoiseOp>(&node.op))
      if (noise->distribution == Distribution::normal) require_normal(scheme_);
}

Lattice::Lattice(Lattice&&) noexcept = default;
Lattice::~Lattice() = default;

int Lattice::channels() const { return model_.nodes.back().channels; }

void Lattice::evaluate(const Box& box, const BoxTarget& target) const {
  if (box.empty()) return;
  Evaluation(model_, plan_, scheme_, seed_).run(box, target, workspaces_->of_thread.local());
}

void Lattice::evaluate(const Box& box, float* values) const {
  const std::ptrdiff_t y_pitch = box.size(2) * channels();
  evaluate(box, {values, box.size(1) * y_pitch, y_pitch});
}

}  // namespace solidtex::engine
