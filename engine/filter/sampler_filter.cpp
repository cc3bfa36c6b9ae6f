#include "engine/filter/sampler_filter.h"

#include <algorithm>

namespace solidtex::engine {
namespace {

// Each part is one evaluation of the network. Octaves fade along the axes of a part at no extra
// cost.
constexpr int kMaxParts = 8;
constexpr double kMinReach = 0.5;  // in texels: less is as good as a point

}  // namespace

// Parts to evaluate, those of one footprint in a row.
struct SamplerFilter::PartList {
  std::vector<double> positions;
  std::vector<Spread> spreads;
  std::vector<float> radii;  // radii of the cubes that select fade steps
  std::vector<int> counts;   // parts per footprint
};

void SamplerFilter::prepare() const {
  once_.run([&] {
    measured_.emplace(Measured{fade_steps_of(sampler_, light_), EqualCube(sampler_)});
  });
}

void SamplerFilter::append_parts(const Axes& axes, const Axes::Axis& middle,
                                 PartList& parts) const {
  const Parts cuts = cut(axes, kMaxParts, kMinReach);
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

// Evaluates parts in linear light.
void SamplerFilter::evaluate(const PartList& parts, const OutputView& output) const {
  const std::size_t count = parts.radii.size();
  sampler_.evaluate_faded(parts.positions.data(), parts.spreads.data(), count, output.values,
                          output.jacobians);
  light_.to_light(output, count);
  for (std::size_t i = 0; i < count; ++i) {
    const FootprintScale scale(parts.radii[i]);
    const auto step = static_cast<std::size_t>(scale.level) + 1;
    fade(measured_->steps, step, scale.fraction, output.from(i * light_.count()));
  }
}

void SamplerFilter::evaluate(std::span<const PlacedFootprint> footprints,
                             const OutputView& output) const {
  PartList parts;
  for (const PlacedFootprint& footprint : footprints)
    append_parts(footprint.axes, footprint.middle, parts);
  const std::size_t channels = light_.count();
  OutputBuffer buffer(parts.radii.size() * channels, output.jacobians != nullptr);
  OutputView part = buffer;
  evaluate(parts, part);
  for (std::size_t i = 0; i < footprints.size(); ++i) {
    const auto count = static_cast<std::size_t>(parts.counts[i]);
    const OutputView mean = output.from(footprints[i].point * channels);
    mean_of(part, count, channels, mean);
    light_.from_light(mean, 1);
    part = part.from(count * channels);
  }
}

}  // namespace solidtex::engine
