#include <algorithm>
#include <array>
#include <vector>

#include "engine/texture/blocks.h"
#include "engine/texture/family.h"
#include "engine/texture/parallel.h"

namespace solidtex::engine {
namespace {

constexpr std::size_t kStep = 20 * kOctaveBlock;  // points evaluated at a time
constexpr std::size_t kGrain = 4;                 // blocks or cubes that are worth a thread

// Voxels are evaluated cube by cube: near points share the cells of the coarse octaves.
constexpr std::int64_t kCubeEdge = 4;

class SamplerFamily : public Family {
 public:
  explicit SamplerFamily(Sampler sampler) : sampler_(std::move(sampler)) {}

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

  std::size_t channels() const { return static_cast<std::size_t>(sampler_.channels()); }

  Sampler sampler_;
};

}  // namespace

std::unique_ptr<Family> make_sampler_family(Sampler sampler) {
  return std::make_unique<SamplerFamily>(std::move(sampler));
}

}  // namespace solidtex::engine
