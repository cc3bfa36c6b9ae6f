#include <algorithm>
#include <array>
#include <mutex>
#include <span>
#include <vector>

#include "engine/texture/blocks.h"
#include "engine/texture/family.h"
#include "engine/texture/parallel.h"
#include "engine/texture/sampler_fade.h"

namespace solidtex::engine {
namespace {

constexpr std::size_t kStep = std::size_t{20} * kOctaveBlock;  // points evaluated at a time
// Blocks or cubes: four are worth a thread, 240 fill the steps of either.
constexpr Grain kGrain(4, 240);

// Voxels are evaluated cube by cube: near points share the cells of the coarse octaves.
constexpr std::int64_t kCubeEdge = 4;

class SamplerFamily : public Family {
 public:
  SamplerFamily(Sampler sampler, LightChannels light)
      : sampler_(std::move(sampler)), light_(std::move(light)) {}

  void eval_points(const PointBatch& batch, float* values) const override {
    // In whole blocks, so that only the last one of all is not full.
    const std::size_t blocks = (batch.count + kOctaveBlock - 1) / kOctaveBlock;
    for_each_part(blocks, kGrain, [&](std::size_t begin, std::size_t end) {
      std::array<double, 3 * kStep> positions;
      const std::size_t stop = std::min(end * kOctaveBlock, batch.count);
      for (std::size_t first = begin * kOctaveBlock; first < stop; first += kStep) {
        const std::size_t step = std::min(kStep, stop - first);
        for (std::size_t i = 0; i < step; ++i)
          for (int axis = 0; axis < 3; ++axis)
            positions[3 * i + axis] = batch.coordinate(first + i, axis);
        sampler_.evaluate(positions.data(), step, values + first * channels());
      }
    });
  }

  void eval_filtered(const PointBatch& batch, const float* radii, float* values) const override {
    // Apart, because points without a footprint are cheaper, and may be in fast precision.
    std::vector<std::size_t> plain, wide;
    for (std::size_t point = 0; point < batch.count; ++point)
      (radii[point] == 0 ? plain : wide).push_back(point);
    for_each_block(plain, [&](std::span<const std::size_t> points) {
      Block block(batch, points, channels());
      sampler_.evaluate(block.positions.data(), points.size(), block.values.data());
      block.scatter(points, values);
    });
    if (wide.empty()) return;
    const std::vector<FadeStep>& steps = fade_steps();
    for_each_block(wide, [&](std::span<const std::size_t> points) {
      Block block(batch, points, channels());
      filter(points, radii, steps, block);
      block.scatter(points, values);
    });
  }

  void eval_box(const Box& box, float* values) const override {
    const BlockSplit cubes(box, {kCubeEdge, kCubeEdge, kCubeEdge});
    for_each_part(cubes.count(), kGrain, [&](std::size_t begin, std::size_t end) {
      VoxelBatch batch(sampler_, box, values);
      for (std::size_t index = begin; index < end; ++index) batch.add(cubes.block(index));
      batch.evaluate();
    });
  }

 private:
  // Collects voxels until they are worth an evaluation.
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

  // Some points of a batch, side by side.
  struct Block {
    Block(const PointBatch& batch, std::span<const std::size_t> points, std::size_t channels_)
        : channels(channels_), positions(3 * points.size()), values(channels_ * points.size()) {
      for (std::size_t i = 0; i < points.size(); ++i)
        for (int axis = 0; axis < 3; ++axis)
          positions[3 * i + axis] = batch.coordinate(points[i], axis);
    }
    void scatter(std::span<const std::size_t> points, float* all) const {
      for (std::size_t i = 0; i < points.size(); ++i)
        std::copy_n(&values[i * channels], channels, all + points[i] * channels);
    }

    std::size_t channels;
    std::vector<double> positions;
    std::vector<float> values;
  };

  // work(points) for the parts of a list, in parallel, whole blocks at a time.
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

  // Faded octaves alone would shift the tones, since the network is not linear: what they give is
  // corrected by what was measured.
  void filter(std::span<const std::size_t> points, const float* radii,
              const std::vector<FadeStep>& steps, Block& block) const {
    std::vector<float> edges;
    for (const std::size_t point : points)
      edges.push_back(std::min(2 * radii[point], static_cast<float>(1 << kCoarsest)));
    sampler_.evaluate_faded(block.positions.data(), edges.data(), points.size(),
                            block.values.data());
    light_.to_light(block.values.data(), points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const FootprintScale scale(radii[points[i]]);
      const auto step = static_cast<std::size_t>(scale.level + 1);
      fade(steps, step, scale.fraction, &block.values[i * channels()]);
    }
    light_.from_light(block.values.data(), points.size());
  }

  // Measured when first asked for: tenths of a second.
  const std::vector<FadeStep>& fade_steps() const {
    std::call_once(measured_, [&] { fade_steps_ = fade_steps_of(sampler_, light_); });
    return fade_steps_;
  }

  std::size_t channels() const { return static_cast<std::size_t>(sampler_.channels()); }

  Sampler sampler_;
  LightChannels light_;
  mutable std::once_flag measured_;
  mutable std::vector<FadeStep> fade_steps_;
};

}  // namespace

std::unique_ptr<Family> make_sampler_family(Sampler sampler, LightChannels light) {
  return std::make_unique<SamplerFamily>(std::move(sampler), std::move(light));
}

}  // namespace solidtex::engine
