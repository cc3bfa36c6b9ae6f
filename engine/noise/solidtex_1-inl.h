// Scheme solidtex-1 on vectors. Included once per target.
#include <hwy/highway.h>

#include <cstddef>

#include "engine/kernels/vector-inl.h"
#include "engine/noise/normal.h"

#if defined(SOLIDTEX_SOLIDTEX_1_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SOLIDTEX_SOLIDTEX_1_INL_H
#undef SOLIDTEX_SOLIDTEX_1_INL_H
#else
#define SOLIDTEX_SOLIDTEX_1_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

#if SOLIDTEX_VECTOR_KERNELS

// First step of the hash, separate for each coordinate.
HWY_INLINE Words Enter(Words coordinate, Words key) {
  const Word d;
  const Words word = hn::Xor(coordinate, key);
  return hn::Add(hn::Mul(word, hn::Set(d, 1664525u)), hn::Set(d, 1013904223u));
}

// kCount hashes computed step by step together: one hash is a chain of slow multiplications, and a
// processor does not look far enough ahead to overlap several. See
// docs/experiments/engine-constants.md.
template <int kCount>
using Many = Words[kCount];

HWY_INLINE Words Fold(Words word) { return hn::Xor(word, hn::ShiftRight<16>(word)); }

// to += x * y
template <int kCount>
HWY_INLINE void AddProducts(const Many<kCount>& x, const Many<kCount>& y, Many<kCount>& to) {
  for (int i = 0; i < kCount; ++i) to[i] = hn::Add(to[i], hn::Mul(x[i], y[i]));
}

template <int kCount>
HWY_INLINE void Cross(Many<kCount>& a, Many<kCount>& b, Many<kCount>& c, Many<kCount>& d) {
  AddProducts<kCount>(b, d, a);
  AddProducts<kCount>(c, a, b);
  AddProducts<kCount>(a, b, c);
  AddProducts<kCount>(b, c, d);
}

// Rest of the hash and the xorshift step.
template <int kCount>
HWY_INLINE void Mix(Many<kCount>& a, Many<kCount>& b, Many<kCount>& c, Many<kCount>& d,
                    Many<kCount>& bits) {
  Cross<kCount>(a, b, c, d);
  for (int i = 0; i < kCount; ++i)
    a[i] = Fold(a[i]), b[i] = Fold(b[i]), c[i] = Fold(c[i]), d[i] = Fold(d[i]);
  Cross<kCount>(a, b, c, d);
  for (int i = 0; i < kCount; ++i) {
    const Words t = hn::Xor(a[i], hn::ShiftLeft<11>(a[i]));
    bits[i] = hn::Xor(hn::Xor(d[i], hn::ShiftRight<19>(d[i])), hn::Xor(t, hn::ShiftRight<8>(t)));
  }
}

HWY_INLINE Floats UniformFromBits(Words bits) {
  const Float d;
  return hn::Mul(hn::ConvertTo(d, hn::BitCast(Int(), hn::ShiftRight<8>(bits))),
                 hn::Set(d, 0x1p-24f));
}

// Evaluates a polynomial at each x, term by term.
template <int kCount, std::size_t kTerms>
HWY_INLINE void Polynomials(const float (&coefficients)[kTerms], const Floats (&x)[kCount],
                            Floats (&values)[kCount]) {
  const Float d;
  for (int i = 0; i < kCount; ++i) values[i] = hn::Set(d, coefficients[kTerms - 1]);
  for (std::size_t k = kTerms - 1; k-- > 0;)
    for (int i = 0; i < kCount; ++i)
      values[i] = FusedMulAdd(values[i], x[i], hn::Set(d, coefficients[k]));
}

template <int kCount>
HWY_INLINE void NormalsFromBits(const Many<kCount>& bits, Floats (&values)[kCount]) {
  const Float d;
  const Int di;
  const Word du;
  Floats f[kCount], exponent[kCount], s[kCount], top[kCount], bottom[kCount];
  for (int i = 0; i < kCount; ++i) {
    const auto low = hn::BitCast(di, hn::And(bits[i], hn::Set(du, 0x7FFFFFFFu)));
    const Floats p =
        hn::Mul(hn::Add(hn::ConvertTo(d, low), hn::Set(d, 0.5f)), hn::Set(d, 0x1p-32f));
    const auto p_bits = hn::BitCast(di, p);
    const auto power = hn::ShiftRight<23>(hn::Sub(p_bits, hn::Set(di, kSqrtHalfBits)));
    exponent[i] = hn::ConvertTo(d, power);
    f[i] = hn::Sub(hn::BitCast(d, hn::Sub(p_bits, hn::ShiftLeft<23>(power))), hn::Set(d, 1.0f));
  }
  Polynomials(kMinus2Log1p, f, s);
  for (int i = 0; i < kCount; ++i) {
    const Floats minus_2_log =
        FusedMulAdd(exponent[i], hn::Set(d, kMinus2Log2), hn::Mul(s[i], f[i]));
    s[i] = hn::Sub(hn::Sqrt(minus_2_log), hn::Set(d, kQuantileStart));
  }
  Polynomials(kQuantileTop, s, top);
  Polynomials(kQuantileBottom, s, bottom);
  for (int i = 0; i < kCount; ++i) {
    const Floats size =
        hn::Div(hn::Mul(s[i], top[i]), FusedMulAdd(bottom[i], s[i], hn::Set(d, 1.0f)));
    const Words negate = hn::AndNot(bits[i], hn::Set(du, 0x80000000u));
    values[i] = hn::Xor(size, hn::BitCast(d, negate));
  }
}
#endif  // SOLIDTEX_VECTOR_KERNELS

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
