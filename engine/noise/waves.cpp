// Waves on the active target, with the bits of their reference.
#include "engine/noise/waves.h"

#include "engine/kernels/targets.h"
// foreach_target.h includes this file once per target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/noise/waves.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "engine/kernels/math.h"
#include "engine/kernels/vector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

#if SOLIDTEX_VECTOR_KERNELS

HWY_INLINE Floats SineOfTurn(Words angle) {
  const Float d;
  const Word du;
  const Int di;
  const Ints turned = hn::BitCast(di, angle);
  const auto outer =
      hn::Or(hn::Gt(turned, hn::Set(di, 1 << 30)), hn::Lt(turned, hn::Set(di, -(1 << 30))));
  const Ints mirrored = hn::BitCast(di, hn::Sub(hn::Set(du, 0x80000000u), angle));
  const Ints folded = hn::IfThenElse(outer, mirrored, turned);
  const Floats x = hn::Mul(hn::ConvertTo(d, folded), hn::Set(d, 0x1p-30f));
  const Floats rest = FusedMulAdd(hn::Neg(x), x, hn::Set(d, 1.0f));
  return FusedMulAdd(hn::Mul(x, rest), Polynomial(kQuarterSine, hn::Mul(x, x)), x);
}

void Waves(const Wave& wave, const LatticePoints& points, int count, float* values) {
  const Word du;
  const auto along = [&](int axis, const std::int32_t* from) {
    return hn::Mul(hn::Set(du, wave.frequency[axis]), hn::BitCast(du, hn::LoadU(Int(), from)));
  };
  const Words first = hn::Set(du, wave.phase + wave.frequency[0] * points.x);
  for (std::ptrdiff_t i = 0; i < count; i += FloatLanes()) {
    const Words across = hn::Add(along(1, points.y + i), along(2, points.z + i));
    StoreFirst(SineOfTurn(hn::Add(first, across)), values + i, count - i);
  }
}

#else

void Waves(const Wave& wave, const LatticePoints& points, int count, float* values) {
  reference::waves(wave, points, count, values);
}

#endif

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace solidtex::engine {

HWY_EXPORT(Waves);

void waves(const Wave& wave, const LatticePoints& points, int count, float* values) {
  HWY_DYNAMIC_DISPATCH(Waves)(wave, points, count, values);
}

void reference::waves(const Wave& wave, const LatticePoints& points, int count, float* values) {
  for (int i = 0; i < count; ++i)
    values[i] = sine_of_turn(wave.phase + wave.frequency[0] * points.x +
                             wave.frequency[1] * static_cast<std::uint32_t>(points.y[i]) +
                             wave.frequency[2] * static_cast<std::uint32_t>(points.z[i]));
}

Wave with_period(const Wave& wave, std::int64_t period) {
  if (period == 0) return wave;
  const auto length = static_cast<std::uint64_t>(period);
  Wave result = wave;
  for (std::uint32_t& frequency : result.frequency) {
    const std::uint64_t turns = (frequency * length + 0x80000000u) >> 32;
    frequency = static_cast<std::uint32_t>(((turns << 32) + length / 2) / length);
  }
  return result;
}

}  // namespace solidtex::engine
#endif
