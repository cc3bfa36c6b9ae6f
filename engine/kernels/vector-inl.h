// Shared by vector kernels: types, partial stores, polynomials. Included once per target.
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "engine/kernels/targets.h"

#if defined(SOLIDTEX_VECTOR_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SOLIDTEX_VECTOR_INL_H
#undef SOLIDTEX_VECTOR_INL_H
#else
#define SOLIDTEX_VECTOR_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Float = hn::ScalableTag<float>;
using Int = hn::RebindToSigned<Float>;
using Word = hn::RebindToUnsigned<Float>;
using Floats = hn::Vec<Float>;
using Ints = hn::Vec<Int>;
using Words = hn::Vec<Word>;

HWY_INLINE std::ptrdiff_t FloatLanes() { return static_cast<std::ptrdiff_t>(hn::Lanes(Float())); }

// Keeps a value in a register. GCC 12 would reload it from memory for each use; loads would then
// limit the loop.
HWY_INLINE Floats InRegister(Floats v) {
#if HWY_COMPILER_GCC && HWY_ARCH_X86
  __asm__("" : "+v"(v.raw));
#endif
  return v;
}

#if HWY_NATIVE_FMA || !SOLIDTEX_VECTOR_KERNELS || defined(SOLIDTEX_UNFUSED)

HWY_INLINE Floats FusedMulAdd(Floats x, Floats y, Floats z) { return hn::MulAdd(x, y, z); }

#else

// Two of the sums x * y + z as doubles, in which the products are exact.
HWY_INLINE v128_t SumsAsDoubles(v128_t x, v128_t y, v128_t z) {
  return wasm_f64x2_add(
      wasm_f64x2_mul(wasm_f64x2_promote_low_f32x4(x), wasm_f64x2_promote_low_f32x4(y)),
      wasm_f64x2_promote_low_f32x4(z));
}

HWY_INLINE v128_t UpperHalf(v128_t v) { return wasm_i64x2_shuffle(v, v, 1, 1); }

// True for doubles halfway between two floats: the sum may have been rounded to there.
HWY_INLINE v128_t IsHalfway(v128_t sums) {
  return wasm_i64x2_eq(wasm_v128_and(sums, wasm_i64x2_const_splat(0x1FFFFFFF)),
                       wasm_i64x2_const_splat(0x10000000));
}

// Rounds sums of doubles to float. Where a second rounding can differ from a single one, which is
// rare, computes again by std::fma: sums halfway between two floats, and subnormal results.
HWY_INLINE Floats FusedMulAdd(Floats x, Floats y, Floats z) {
  const Float d;
  const v128_t low = SumsAsDoubles(x.raw, y.raw, z.raw);
  const v128_t high = SumsAsDoubles(UpperHalf(x.raw), UpperHalf(y.raw), UpperHalf(z.raw));
  const v128_t sum = wasm_i64x2_shuffle(wasm_f32x4_demote_f64x2_zero(low),
                                        wasm_f32x4_demote_f64x2_zero(high), 0, 2);
  const v128_t is_small =
      wasm_v128_and(wasm_f32x4_le(wasm_f32x4_abs(sum), wasm_f32x4_const_splat(0x1p-126f)),
                    wasm_f32x4_ne(sum, wasm_f32x4_const_splat(0)));
  const v128_t is_halfway = wasm_v128_or(IsHalfway(low), IsHalfway(high));
  if (HWY_UNLIKELY(wasm_v128_any_true(wasm_v128_or(is_small, is_halfway)))) {
    HWY_ALIGN float a[4], b[4], c[4];
    hn::Store(x, d, a);
    hn::Store(y, d, b);
    hn::Store(z, d, c);
    for (int i = 0; i < 4; ++i) c[i] = std::fma(a[i], b[i], c[i]);
    return hn::Load(d, c);
  }
  return Floats{sum};
}

#endif

// Stores the first `count` lanes.
HWY_INLINE void StoreFirst(Floats v, float* to, std::ptrdiff_t count) {
  const Float d;
  if (count >= FloatLanes()) {
    hn::StoreU(v, d, to);
  } else {
    HWY_ALIGN float lanes[hn::MaxLanes(d)];
    hn::Store(v, d, lanes);
    std::copy_n(lanes, count, to);
  }
}

// Horner's rule, lowest coefficient first.
template <std::size_t kCount>
HWY_INLINE Floats Polynomial(const float (&coefficients)[kCount], Floats x) {
  const Float d;
  Floats sum = hn::Set(d, coefficients[kCount - 1]);
  for (std::size_t i = kCount - 1; i-- > 0;) sum = FusedMulAdd(sum, x, hn::Set(d, coefficients[i]));
  return sum;
}

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
