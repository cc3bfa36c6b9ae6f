// Compiled for each target, so that a fused multiply-add is an instruction and not a call: cached
// points take 0.7 of the time.
#include "engine/kernels/targets.h"
// foreach_target.h includes this file once per target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/texture/brick_lookup.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "engine/texture/brick_lookup.h"

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

// Inlined, so that the grid of level 0 is a constant: 5 to 10 % less time for cached points.
template <class Batch>
HWY_INLINE void LookUpOn(const BrickGrid grid, const Brick& brick, const Batch& batch,
                         std::span<const std::uint32_t> which, std::span<const PlacedPoint> points,
                         const Answers& answers) {
  const std::size_t channels = brick.channels;
  if (!answers.gradients) {
    for (const PlacedPoint& point : points)
      interpolate(brick.values, grid, cells_of(batch, which[point.place], grid), channels,
                  answers.values + point.place * channels);
    return;
  }
  for (const PlacedPoint& point : points) {
    const Answers answer = answers.from(point.place * channels);
    interpolate_with_slopes(brick.values, grid, cells_of(batch, which[point.place], grid), channels,
                            answer.values, answer.gradients);
  }
}

template <class Batch>
HWY_INLINE void LookUp(const Brick& brick, const Batch& batch, std::span<const std::uint32_t> which,
                       std::span<const PlacedPoint> points, const Answers& answers) {
  if (brick.grid.level == 0) {
    LookUpOn(BrickGrid{}, brick, batch, which, points, answers);
  } else {
    LookUpOn(brick.grid, brick, batch, which, points, answers);
  }
}

void LookUpPoints(const Brick& brick, const PointBatch& batch, std::span<const std::uint32_t> which,
                  std::span<const PlacedPoint> points, const Answers& answers) {
  LookUp(brick, batch, which, points, answers);
}

void LookUpPositions(const Brick& brick, const PositionBatch& batch,
                     std::span<const std::uint32_t> which, std::span<const PlacedPoint> points,
                     const Answers& answers) {
  LookUp(brick, batch, which, points, answers);
}

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace solidtex::engine {

HWY_EXPORT(LookUpPoints);
HWY_EXPORT(LookUpPositions);

void look_up(const Brick& brick, const PointBatch& batch, std::span<const std::uint32_t> which,
             std::span<const PlacedPoint> points, const Answers& answers) {
  HWY_DYNAMIC_DISPATCH(LookUpPoints)(brick, batch, which, points, answers);
}

void look_up(const Brick& brick, const PositionBatch& batch, std::span<const std::uint32_t> which,
             std::span<const PlacedPoint> points, const Answers& answers) {
  HWY_DYNAMIC_DISPATCH(LookUpPositions)(brick, batch, which, points, answers);
}

}  // namespace solidtex::engine
#endif
