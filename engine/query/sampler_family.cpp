#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "engine/common/parallel.h"
#include "engine/filter/axes.h"
#include "engine/filter/sampler_filter.h"
#include "engine/query/blocks.h"
#include "engine/query/family.h"

namespace solidtex::engine {
namespace {

constexpr std::size_t kStep = std::size_t{20} * kOctaveBlock;  // points evaluated at a time
// In blocks or cubes: four are worth a thread, 240 fill the steps of either.
constexpr Grain kGrain(4, 240);

// Voxels are evaluated cube by cube: nearby points share cells of the coarse octaves.
constexpr std::int64_t kCubeEdge = 4;

class SamplerFamily : public Family {
 public:
  SamplerFamily(Sampler sampler, LightChannels light)
      : sampler_(std::move(sampler)), light_(std::move(light)) {}

  void eval(const PointBatch& batch, const Footprints& footprints,
            const OutputView& output) const override {
    const float *radii = footprints.radii, *axes = footprints.axes;
    if (axes) {
      filter(
          batch, [&](std::size_t point) { return Axes::of(axes + 9 * point); }, output);
    } else if (radii) {
      filter(
          batch, [&](std::size_t point) { return Axes::cube(radii[point]); }, output);
    } else {
      eval_points(batch, output);
    }
  }

  ScratchMeter& scratch() const override { return scratch_; }

  void eval_box(const Box& box, float* values) const override {
    const BlockSplit cubes(box, {kCubeEdge, kCubeEdge, kCubeEdge});
    for_each_part(cubes.count(), kGrain, [&](std::size_t begin, std::size_t end) {
      VoxelBatch batch(sampler_, box, values);
      const ScratchUse use(scratch_, sizeof batch + kStep * channels() * sizeof(float));
      for (std::size_t index = begin; index < end; ++index) batch.add(cubes.block(index));
      batch.evaluate();
    });
  }

 private:
  void eval_points(const PointBatch& batch, const OutputView& output) const {
    // Whole blocks, so that only the last one is not full.
    const std::size_t blocks = (batch.count + kOctaveBlock - 1) / kOctaveBlock;
    for_each_part(blocks, kGrain, [&](std::size_t begin, std::size_t end) {
      std::array<double, 3 * kStep> positions;
      const ScratchUse use(scratch_, batch.count < kStep ? 0 : sizeof positions);
      const std::size_t stop = std::min(end * kOctaveBlock, batch.count);
      for (std::size_t first = begin * kOctaveBlock; first < stop; first += kStep) {
        const std::size_t step = std::min(kStep, stop - first);
        for (std::size_t i = 0; i < step; ++i)
          for (int axis = 0; axis < 3; ++axis)
            positions[3 * i + axis] = batch.coordinate(first + i, axis);
        evaluate(positions.data(), step, output.from(first * channels()));
      }
    });
  }

  // Evaluates points without footprints.
  void evaluate(const double* positions, std::size_t count, const OutputView& output) const {
    if (output.jacobians) {
      sampler_.evaluate_faded(positions, nullptr, count, output.values, output.jacobians);
    } else {
      sampler_.evaluate(positions, count, output.values);
    }
  }

  // Collects voxels and evaluates them in batches.
  class VoxelBatch {
   public:
    VoxelBatch(const Sampler& sampler, const Box& box, float* values)
        : sampler_(sampler), box_(box), values_(values) {}

    void add(const Box& cube) {
      for (std::int64_t x = cube.lo[0]; x < cube.hi[0]; ++x)
        for (std::int64_t y = cube.lo[1]; y < cube.hi[1]; ++y)
          for (std::int64_t z = cube.lo[2]; z < cube.hi[2]; ++z) add(x, y, z);
    }

    void evaluate() {
      const auto channels = static_cast<std::size_t>(sampler_.channels());
      results_.resize(count_ * channels);
      sampler_.evaluate(positions_.data(), count_, results_.data());
      for (std::size_t i = 0; i < count_; ++i)
        std::copy_n(&results_[i * channels], channels, values_ + voxels_[i] * channels);
      count_ = 0;
    }

   private:
    void add(std::int64_t x, std::int64_t y, std::int64_t z) {
      const std::int64_t row = (x - box_.lo[0]) * box_.size(1) + (y - box_.lo[1]);
      voxels_[count_] = static_cast<std::size_t>(row * box_.size(2) + (z - box_.lo[2]));
      double* position = &positions_[3 * count_];
      position[0] = static_cast<double>(x) + 0.5;
      position[1] = static_cast<double>(y) + 0.5;
      position[2] = static_cast<double>(z) + 0.5;
      if (++count_ == kStep) evaluate();
    }

    const Sampler& sampler_;
    const Box& box_;
    float* values_;
    std::size_t count_ = 0;
    std::array<std::size_t, kStep> voxels_;
    std::array<double, 3 * kStep> positions_;
    std::vector<float> results_;
  };

  // Calls work(points) in parallel for parts of a list, in whole blocks.
  template <class Work>
  static void for_each_block(const std::vector<std::size_t>& points, const Work& work) {
    const std::size_t steps = (points.size() + kStep - 1) / kStep;
    for_each_part(steps, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t step = begin; step < end; ++step) {
        const std::size_t first = step * kStep;
        work(std::span(points).subspan(first, std::min(kStep, points.size() - first)));
      }
    });
  }

  template <class AxesOf>
  void filter(const PointBatch& batch, const AxesOf& axes_of, const OutputView& output) const {
    // Separates points without a footprint: they are cheaper and may use fast precision.
    std::vector<std::size_t> plain, wide;
    for (std::size_t point = 0; point < batch.count; ++point)
      (axes_of(point).is_point() ? plain : wide).push_back(point);
    const ScratchUse use(scratch_, batch.count * sizeof(std::size_t));
    const double share = static_cast<double>(plain.size()) / static_cast<double>(batch.count);
    evaluate_plain(batch, plain, output, ProgressScope(0.0, share));
    if (!wide.empty()) evaluate_wide(batch, wide, axes_of, output, ProgressScope(share, 1.0));
  }

  void evaluate_plain(const PointBatch& batch, const std::vector<std::size_t>& which,
                      const OutputView& output, const ProgressScope&) const {
    for_each_block(which, [&](std::span<const std::size_t> points) {
      std::vector<double> positions;
      for (const std::size_t point : points)
        for (int axis = 0; axis < 3; ++axis) positions.push_back(batch.coordinate(point, axis));
      OutputBuffer buffer(points.size() * channels(), output.jacobians != nullptr);
      const OutputView found = buffer;
      const ScratchUse use(scratch_, positions.size() * sizeof(double) + buffer.bytes());
      evaluate(positions.data(), points.size(), found);
      output.for_both([&](auto member, std::size_t width) {
        const std::size_t step = width * channels();
        for (std::size_t i = 0; i < points.size(); ++i)
          std::copy_n(found.*member + i * step, step, output.*member + points[i] * step);
      });
    });
  }

  template <class AxesOf>
  void evaluate_wide(const PointBatch& batch, const std::vector<std::size_t>& which,
                     const AxesOf& axes_of, const OutputView& output, const ProgressScope&) const {
    prepare_filter(ProgressScope(0.0, 0.0));
    for_each_block(which, [&](std::span<const std::size_t> points) {
      std::vector<PlacedFootprint> footprints;
      for (const std::size_t point : points)
        footprints.push_back(
            {point,
             {batch.coordinate(point, 0), batch.coordinate(point, 1), batch.coordinate(point, 2)},
             axes_of(point)});
      const ScratchUse use(scratch_, footprints.size() * sizeof(PlacedFootprint));
      filter_.evaluate(footprints, output);
    });
  }

  void prepare_filter(const ProgressScope&) const { filter_.prepare(); }

  std::size_t channels() const { return static_cast<std::size_t>(sampler_.channels()); }

  Sampler sampler_;
  LightChannels light_;
  SamplerFilter filter_{sampler_, light_};
  mutable ScratchMeter scratch_;
};

}  // namespace

std::unique_ptr<Family> make_sampler_family(Sampler sampler, LightChannels light) {
  return std::make_unique<SamplerFamily>(std::move(sampler), std::move(light));
}

}  // namespace solidtex::engine
