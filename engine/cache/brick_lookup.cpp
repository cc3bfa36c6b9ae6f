// Compiled for each target: a fused multiply-add is an instruction here, not a call.
#include "engine/kernels/targets.h"
// foreach_target.h includes this file once per target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/cache/brick_lookup.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "engine/cache/brick_lookup.h"

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

// Evaluates kChannels channels at a time. Inlined, so that `channels` is a constant where it can
// be.
template <class Kernel, std::size_t kChannels, class Batch>
HWY_INLINE void LookUpOn(const Brick& brick, const std::size_t channels, const Batch& batch,
                         std::span<const std::uint32_t> which, std::span<const PlacedPoint> points,
                         const OutputView& output) {
  const auto voxels = static_cast<std::size_t>(brick.grid.voxels());
  const std::size_t z = channels, y = voxels * z, x = voxels * y;
  const auto per_texel = static_cast<float>(brick.grid.voxels_per_texel);
  for (const PlacedPoint& point : points) {
    const auto at = cells_of(batch, which[point.place], brick.grid);
    const float* corner = brick.values + at[0].voxel * x + at[1].voxel * y + at[2].voxel * z;
    for (std::size_t c = 0; c < channels; c += kChannels) {
      const Cell<Kernel, kChannels> cell{corner + c, x, y, z};
      const OutputView point_output = output.from(point.place * channels + c);
      if (point_output.jacobians) {
        cell.interpolate_with_derivatives(at, per_texel, point_output.values,
                                          point_output.jacobians);
      } else {
        cell.interpolate(at, point_output.values);
      }
    }
  }
}

// Colors with up to two further maps are evaluated in one pass over all channels.
template <class Kernel, class Batch>
HWY_INLINE void LookUpBy(const Brick& brick, const Batch& batch,
                         std::span<const std::uint32_t> which, std::span<const PlacedPoint> points,
                         const OutputView& output) {
  switch (brick.channels) {
    case 3:
      return LookUpOn<Kernel, 3>(brick, 3, batch, which, points, output);
    case 4:
      return LookUpOn<Kernel, 4>(brick, 4, batch, which, points, output);
    case 5:
      return LookUpOn<Kernel, 5>(brick, 5, batch, which, points, output);
    default:
      return LookUpOn<Kernel, 1>(brick, brick.channels, batch, which, points, output);
  }
}

template <class Batch>
HWY_INLINE void LookUp(const Brick& brick, const Batch& batch, std::span<const std::uint32_t> which,
                       std::span<const PlacedPoint> points, const OutputView& output) {
  if (brick.grid.is_cubic()) {
    LookUpBy<Cubic>(brick, batch, which, points, output);
  } else {
    LookUpBy<Linear>(brick, batch, which, points, output);
  }
}

void LookUpPoints(const Brick& brick, const PointBatch& batch, std::span<const std::uint32_t> which,
                  std::span<const PlacedPoint> points, const OutputView& output) {
  LookUp(brick, batch, which, points, output);
}

void LookUpPositions(const Brick& brick, const PositionBatch& batch,
                     std::span<const std::uint32_t> which, std::span<const PlacedPoint> points,
                     const OutputView& output) {
  LookUp(brick, batch, which, points, output);
}

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace solidtex::engine {

HWY_EXPORT(LookUpPoints);
HWY_EXPORT(LookUpPositions);

void look_up(const Brick& brick, const PointBatch& batch, std::span<const std::uint32_t> which,
             std::span<const PlacedPoint> points, const OutputView& output) {
  HWY_DYNAMIC_DISPATCH(LookUpPoints)(brick, batch, which, points, output);
}

void look_up(const Brick& brick, const PositionBatch& batch, std::span<const std::uint32_t> which,
             std::span<const PlacedPoint> points, const OutputView& output) {
  HWY_DYNAMIC_DISPATCH(LookUpPositions)(brick, batch, which, points, output);
}

}  // namespace solidtex::engine
#endif
