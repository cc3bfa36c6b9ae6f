#include "engine/texture/sampler_filter.h"

#include <algorithm>

namespace solidtex::engine {
namespace {

// Each part is an evaluation of the network. Octaves that fade along its axes cost nothing more and
// make up for some parts: cubes would need more of them for the same error.
constexpr int kMostParts = 8;
constexpr double kLeastReach = 0.5;  // texels: less is as good as a point

}  // namespace

// Evaluations, those of a footprint behind each other.
struct SamplerFilter::PartList {
  std::vector<double> positions;
  std::vector<Spread> spreads;
  std::vector<float> radii;  // of the cubes whose corrections they take
  std::vector<int> counts;   // per footprint
};

void SamplerFilter::prepare() const {
  std::call_once(once_, [&] {
    measured_.emplace(Measured{fade_steps_of(sampler_, light_), EqualCube(sampler_)});
  });
}

void SamplerFilter::append_parts(const Axes& axes, const Axes::Axis& middle,
                                 PartList& parts) const {
  const Parts cuts = cut(axes, kMostParts, kLeastReach);
  const bool endless = axes.is_endless();
  const Spread spread = endless ? Spread{} : Spread::of(cuts.axes.axis);
  float radius = endless ? static_cast<float>(kEndless) : cuts.axes.cube_radius();
  if (radius == 0) radius = measured_->cube.radius(sampler_.kept(spread));
  for_each_middle(cuts, [&](const Axes::Axis& step) {
    for (std::size_t k = 0; k < 3; ++k) parts.positions.push_back(middle[k] + step[k]);
    parts.spreads.push_back(spread);
    parts.radii.push_back(radius);
  });
  parts.counts.push_back(cuts.total());
}

// In light.
void SamplerFilter::evaluate(const PartList& parts, const Answers& answers) const {
  const std::size_t count = parts.radii.size();
  sampler_.evaluate_faded(parts.positions.data(), parts.spreads.data(), count, answers.values,
                          answers.gradients);
  light_.to_light(answers, count);
  for (std::size_t i = 0; i < count; ++i) {
    const FootprintScale scale(parts.radii[i]);
    const auto step = static_cast<std::size_t>(scale.level + 1);
    fade(measured_->steps, step, scale.fraction, answers.from(i * light_.count()));
  }
}

void SamplerFilter::evaluate(std::span<const PlacedFootprint> footprints,
                             const Answers& answers) const {
  PartList parts;
  for (const PlacedFootprint& footprint : footprints)
    append_parts(footprint.axes, footprint.middle, parts);
  const std::size_t channels = light_.count();
  AnswerBuffer buffer(parts.radii.size() * channels, answers.gradients != nullptr);
  Answers part = buffer;
  evaluate(parts, part);
  for (std::size_t i = 0; i < footprints.size(); ++i) {
    const auto count = static_cast<std::size_t>(parts.counts[i]);
    const Answers mean = answers.from(footprints[i].point * channels);
    mean_of(part, count, channels, mean);
    light_.from_light(mean, 1);
    part = part.from(count * channels);
  }
}

}  // namespace solidtex::engine
