#include "engine/field/field.h"

#include <tbb/enumerable_thread_specific.h>

#include "engine/field/evaluation.h"
#include "engine/noise/noise.h"

namespace solidtex::engine {

struct Field::Workspaces {
  tbb::enumerable_thread_specific<Workspace> of_thread;
};

Field::Field(FieldModel model, NoiseScheme scheme, std::uint64_t seed)
    : model_(std::move(model)),
      plan_(make_plan(model_)),
      scheme_(scheme),
      seed_(seed),
      workspaces_(std::make_unique<Workspaces>()) {
  for (const Node& node : model_.nodes)
    if (const auto* noise = std::get_if<NoiseOp>(&node.op))
      if (noise->distribution == Distribution::normal) require_normal(scheme_);
}

Field::Field(Field&&) noexcept = default;
Field::~Field() = default;

int Field::channels() const { return model_.nodes.back().channels; }

void Field::evaluate(const Box& box, const BoxTarget& target) const {
  if (box.empty()) return;
  Evaluation(model_, plan_, scheme_, seed_).run(box, target, workspaces_->of_thread.local());
}

void Field::evaluate(const Box& box, float* values) const {
  const std::ptrdiff_t y_pitch = box.size(2) * channels();
  evaluate(box, {values, box.size(1) * y_pitch, y_pitch});
}

}  // namespace solidtex::engine
