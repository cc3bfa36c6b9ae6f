// Transforms of Winograd's minimal filtering along one axis. Included once per target.
//
// F(4, 3) uses the points 0, 1, -1, 2, -2 and infinity (Lavin and Gray, section 4.1). All factors
// except those of weights are powers of two: only additions round.
#include <hwy/highway.h>

#include "engine/kernels/vector-inl.h"

#if defined(SOLIDTEX_WINOGRAD_TRANSFORMS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SOLIDTEX_WINOGRAD_TRANSFORMS_INL_H
#undef SOLIDTEX_WINOGRAD_TRANSFORMS_INL_H
#else
#define SOLIDTEX_WINOGRAD_TRANSFORMS_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

// factor * a + b.
HWY_INLINE Floats Scaled(float factor, Floats a, Floats b) {
  return FusedMulAdd(hn::Set(Float(), factor), a, b);
}

// B^T d of F(2, 3): (d0 - d2, d1 + d2, d2 - d1, d1 - d3).
HWY_INLINE void TransformInput(Floats (&d)[4]) {
  const Floats v0 = hn::Sub(d[0], d[2]), v1 = hn::Add(d[1], d[2]), v2 = hn::Sub(d[2], d[1]),
               v3 = hn::Sub(d[1], d[3]);
  d[0] = v0, d[1] = v1, d[2] = v2, d[3] = v3;
}

// A^T m of F(2, 3): (m0 + m1 + m2, m1 - m2 - m3).
HWY_INLINE void TransformOutput(const Floats (&m)[4], Floats (&y)[2]) {
  y[0] = hn::Add(hn::Add(m[0], m[1]), m[2]);
  y[1] = hn::Sub(hn::Sub(m[1], m[2]), m[3]);
}

// B^T d of F(4, 3).
HWY_INLINE void TransformInput(Floats (&d)[6]) {
  const Floats odd = hn::Sub(d[3], d[1]), even = hn::Sub(d[4], d[2]);
  const Floats wide_odd = Scaled(-4, d[1], d[3]), wide_even = Scaled(-4, d[2], d[4]);
  d[0] = Scaled(4, hn::Sub(d[0], d[2]), even);
  d[5] = Scaled(-4, odd, hn::Sub(d[5], d[3]));
  d[1] = hn::Add(wide_even, wide_odd);
  d[2] = hn::Sub(wide_even, wide_odd);
  d[3] = Scaled(2, odd, even);
  d[4] = Scaled(-2, odd, even);
}

// A^T m of F(4, 3).
HWY_INLINE void TransformOutput(const Floats (&m)[6], Floats (&y)[4]) {
  const Floats sum = hn::Add(m[1], m[2]), difference = hn::Sub(m[1], m[2]);
  const Floats wide_sum = hn::Add(m[3], m[4]), wide_difference = hn::Sub(m[3], m[4]);
  y[0] = hn::Add(hn::Add(m[0], sum), wide_sum);
  y[1] = Scaled(2, wide_difference, difference);
  y[2] = Scaled(4, wide_sum, sum);
  y[3] = hn::Add(Scaled(8, wide_difference, difference), m[5]);
}

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
