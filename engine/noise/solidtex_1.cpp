// Rows and trilinear lookups of the scheme solidtex-1 on the machine's best target.
#include "engine/noise/solidtex_1.h"

#include "engine/kernels/targets.h"
// foreach_target.h includes this file once per target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/noise/solidtex_1.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "engine/kernels/vector-inl.h"
#include "engine/noise/normal.h"

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

#if HWY_NATIVE_FMA

// The first step of the hash, which each coordinate takes alone.
HWY_INLINE Words Enter(Words coordinate, std::uint32_t key) {
  const Word d;
  const Words word = hn::Xor(coordinate, hn::Set(d, key));
  return hn::Add(hn::Mul(word, hn::Set(d, 1664525u)), hn::Set(d, 1013904223u));
}

HWY_INLINE void Cross(Words& a, Words& b, Words& c, Words& d) {
  a = hn::Add(a, hn::Mul(b, d));
  b = hn::Add(b, hn::Mul(c, a));
  c = hn::Add(c, hn::Mul(a, b));
  d = hn::Add(d, hn::Mul(b, c));
}

HWY_INLINE Words Fold(Words word) { return hn::Xor(word, hn::ShiftRight<16>(word)); }

// The rest of the hash and the xorshift step.
HWY_INLINE Words Mix(Words a, Words b, Words c, Words d) {
  Cross(a, b, c, d);
  a = Fold(a), b = Fold(b), c = Fold(c), d = Fold(d);
  Cross(a, b, c, d);
  const Words t = hn::Xor(a, hn::ShiftLeft<11>(a));
  return hn::Xor(hn::Xor(d, hn::ShiftRight<19>(d)), hn::Xor(t, hn::ShiftRight<8>(t)));
}

HWY_INLINE Floats UniformFromBits(Words bits) {
  const Float d;
  return hn::Mul(hn::ConvertTo(d, hn::BitCast(Int(), hn::ShiftRight<8>(bits))),
                 hn::Set(d, 0x1p-24f));
}

HWY_INLINE Floats NormalFromBits(Words bits) {
  const Float d;
  const Int di;
  const Word du;
  const auto low = hn::BitCast(di, hn::And(bits, hn::Set(du, 0x7FFFFFFFu)));
  const Floats p = hn::Mul(hn::Add(hn::ConvertTo(d, low), hn::Set(d, 0.5f)), hn::Set(d, 0x1p-32f));
  const auto p_bits = hn::BitCast(di, p);
  const auto exponent = hn::ShiftRight<23>(hn::Sub(p_bits, hn::Set(di, kSqrtHalfBits)));
  const Floats f =
      hn::Sub(hn::BitCast(d, hn::Sub(p_bits, hn::ShiftLeft<23>(exponent))), hn::Set(d, 1.0f));
  const Floats minus_2_log = hn::MulAdd(hn::ConvertTo(d, exponent), hn::Set(d, kMinus2Log2),
                                        hn::Mul(Polynomial(kMinus2Log1p, f), f));
  const Floats s = hn::Sub(hn::Sqrt(minus_2_log), hn::Set(d, kQuantileStart));
  const Floats top = hn::Mul(s, Polynomial(kQuantileTop, s));
  const Floats bottom = hn::MulAdd(Polynomial(kQuantileBottom, s), s, hn::Set(d, 1.0f));
  const Words negate = hn::AndNot(bits, hn::Set(du, 0x80000000u));
  return hn::Xor(hn::Div(top, bottom), hn::BitCast(d, negate));
}

template <class FromBits>
HWY_INLINE void RowOf(FromBits from_bits, const StreamKey& key, std::uint32_t x, std::uint32_t y,
                      std::uint32_t z, int count, float* values) {
  const Word du;
  const Words a = Enter(hn::Set(du, x), key.word[0]), b = Enter(hn::Set(du, y), key.word[1]),
              d = Enter(hn::Zero(du), key.word[3]);
  for (std::ptrdiff_t i = 0; i < count; i += FloatLanes()) {
    const Words c = Enter(hn::Iota(du, z + static_cast<std::uint32_t>(i)), key.word[2]);
    StoreFirst(from_bits(Mix(a, b, c, d)), values + i, count - i);
  }
}

void Row(const StreamKey& key, Distribution distribution, std::uint32_t x, std::uint32_t y,
         std::uint32_t z, int count, float* values) {
  if (distribution == Distribution::normal)
    RowOf([](Words bits) { return NormalFromBits(bits); }, key, x, y, z, count, values);
  else
    RowOf([](Words bits) { return UniformFromBits(bits); }, key, x, y, z, count, values);
}

HWY_INLINE Floats Lerp(Floats t, Floats a, Floats b) { return hn::MulAdd(t, hn::Sub(b, a), a); }

// The vector of points that begins at point i.
HWY_INLINE Floats Trilinear(const StreamKey& key, const LatticeCells& cells, std::ptrdiff_t i) {
  const Word du;
  Words word[3][2];
  Floats fraction[3];
  for (int axis = 0; axis < 3; ++axis) {
    const Words corner = hn::BitCast(du, hn::LoadU(Int(), cells.corner[axis] + i));
    word[axis][0] = Enter(corner, key.word[axis]);
    word[axis][1] = Enter(hn::Add(corner, hn::Set(du, 1)), key.word[axis]);
    fraction[axis] = hn::LoadU(Float(), cells.fraction[axis] + i);
  }
  const Words last = Enter(hn::Zero(du), key.word[3]);
  const auto normal = [&](int x, int y, int z) {
    return NormalFromBits(Mix(word[0][x], word[1][y], word[2][z], last));
  };
  const auto along_z = [&](int x, int y) {
    return Lerp(fraction[2], normal(x, y, 0), normal(x, y, 1));
  };
  const auto along_y = [&](int x) { return Lerp(fraction[1], along_z(x, 0), along_z(x, 1)); };
  return Lerp(fraction[0], along_y(0), along_y(1));
}

void TrilinearNormal(const StreamKey& key, const LatticeCells& cells, int count, float* values) {
  for (std::ptrdiff_t i = 0; i < count; i += FloatLanes())
    StoreFirst(Trilinear(key, cells, i), values + i, count - i);
}

#else

void Row(const StreamKey& key, Distribution distribution, std::uint32_t x, std::uint32_t y,
         std::uint32_t z, int count, float* values) {
  reference::row(key, distribution, x, y, z, count, values);
}
void TrilinearNormal(const StreamKey& key, const LatticeCells& cells, int count, float* values) {
  reference::trilinear_normal(key, cells, count, values);
}

#endif

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace solidtex::engine::solidtex_1 {

HWY_EXPORT(Row);
HWY_EXPORT(TrilinearNormal);

void row(const StreamKey& key, Distribution distribution, std::uint32_t x, std::uint32_t y,
         std::uint32_t z, int count, float* values) {
  HWY_DYNAMIC_DISPATCH(Row)(key, distribution, x, y, z, count, values);
}

void trilinear_normal(const StreamKey& key, const LatticeCells& cells, int count, float* values) {
  HWY_DYNAMIC_DISPATCH(TrilinearNormal)(key, cells, count, values);
}

}  // namespace solidtex::engine::solidtex_1
#endif
