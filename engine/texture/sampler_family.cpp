#include <algorithm>
#include <array>

#include "engine/texture/family.h"
#include "engine/texture/parallel.h"

namespace solidtex::engine {
namespace {

constexpr std::size_t kStep = 20 * kOctaveBlock;  // points evaluated at a time
constexpr std::size_t kGrain = 4;                 // blocks that are worth a thread

// Centre of the voxel with the given index in [x][y][z] order.
void voxel_centre(const Box& box, std::size_t index, double* position) {
  for (int axis = 2; axis >= 0; --axis) {
    const auto size = static_cast<std::size_t>(box.size(axis));
    const auto voxel = box.lo[axis] + static_cast<std::int64_t>(index % size);
    position[axis] = static_cast<double>(voxel) + 0.5;
    index /= size;
  }
}

class SamplerFamily : public Family {
 public:
  explicit SamplerFamily(Sampler sampler) : sampler_(std::move(sampler)) {}

  void eval_points(const PointBatch& batch, float* values) const override {
    evaluate(batch.count, values, [&](std::size_t point, double* position) {
      for (int axis = 0; axis < 3; ++axis) position[axis] = batch.coordinate(point, axis);
    });
  }

  void eval_box(const Box& box, float* values) const override {
    evaluate(box.volume(), values,
             [&](std::size_t index, double* position) { voxel_centre(box, index, position); });
  }

 private:
  template <class PositionOf>
  void evaluate(std::size_t count, float* values, const PositionOf& position_of) const {
    const auto channels = static_cast<std::size_t>(sampler_.channels());
    // In whole blocks, so that only the last one of all is not full.
    const std::size_t blocks = (count + kOctaveBlock - 1) / kOctaveBlock;
    for_each_part(blocks, kGrain, [&](std::size_t begin, std::size_t end) {
      std::array<double, 3 * kStep> positions;
      const std::size_t stop = std::min(end * kOctaveBlock, count);
      for (std::size_t first = begin * kOctaveBlock; first < stop; first += kStep) {
        const std::size_t step = std::min(kStep, stop - first);
        for (std::size_t i = 0; i < step; ++i) position_of(first + i, &positions[3 * i]);
        sampler_.evaluate(positions.data(), step, values + first * channels);
      }
    });
  }

  Sampler sampler_;
};

}  // namespace

std::unique_ptr<Family> make_sampler_family(Sampler sampler) {
  return std::make_unique<SamplerFamily>(std::move(sampler));
}

}  // namespace solidtex::engine
