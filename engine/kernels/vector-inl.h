// Shared by vector kernels: types, partial stores, polynomials. Included once per target.
#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>

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
  for (std::size_t i = kCount - 1; i-- > 0;) sum = hn::MulAdd(sum, x, hn::Set(d, coefficients[i]));
  return sum;
}

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
