// Planes and trilinear lookups of the scheme solidtex-1 on the machine's best target.
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
HWY_INLINE Words Enter(Words coordinate, Words key) {
  const Word d;
  const Words word = hn::Xor(coordinate, key);
  return hn::Add(hn::Mul(word, hn::Set(d, 1664525u)), hn::Set(d, 1013904223u));
}

// kCount hashes, step by step together: the steps of one are a chain of slow multiplications, and a
// processor looks ahead over no more than a few of them. The eight of a cell one after the other
// cost 90 cycles of a Sapphire Rapids each, normals included, together 51 (AVX2: 84 and 45).
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

// The rest of the hash and the xorshift step.
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

// values = polynomial of x, term by term.
template <int kCount, std::size_t kTerms>
HWY_INLINE void Polynomials(const float (&coefficients)[kTerms], const Floats (&x)[kCount],
                            Floats (&values)[kCount]) {
  const Float d;
  for (int i = 0; i < kCount; ++i) values[i] = hn::Set(d, coefficients[kTerms - 1]);
  for (std::size_t k = kTerms - 1; k-- > 0;)
    for (int i = 0; i < kCount; ++i)
      values[i] = hn::MulAdd(values[i], x[i], hn::Set(d, coefficients[k]));
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
        hn::MulAdd(exponent[i], hn::Set(d, kMinus2Log2), hn::Mul(s[i], f[i]));
    s[i] = hn::Sub(hn::Sqrt(minus_2_log), hn::Set(d, kQuantileStart));
  }
  Polynomials(kQuantileTop, s, top);
  Polynomials(kQuantileBottom, s, bottom);
  for (int i = 0; i < kCount; ++i) {
    const Floats size =
        hn::Div(hn::Mul(s[i], top[i]), hn::MulAdd(bottom[i], s[i], hn::Set(d, 1.0f)));
    const Words negate = hn::AndNot(bits[i], hn::Set(du, 0x80000000u));
    values[i] = hn::Xor(size, hn::BitCast(d, negate));
  }
}

struct Uniform {
  template <int kCount>
  HWY_INLINE static void FromBits(const Many<kCount>& bits, Floats (&values)[kCount]) {
    for (int i = 0; i < kCount; ++i) values[i] = UniformFromBits(bits[i]);
  }
};
struct Normal {
  template <int kCount>
  HWY_INLINE static void FromBits(const Many<kCount>& bits, Floats (&values)[kCount]) {
    NormalsFromBits<kCount>(bits, values);
  }
};

// The values of kCount vectors of points from point i on.
template <class Kind, int kCount>
HWY_INLINE void PointValues(const StreamKey& key, const LatticePoints& points, std::ptrdiff_t i,
                            Floats (&values)[kCount]) {
  const Word du;
  const auto word = [&](int axis) { return hn::Set(du, key.word[axis]); };
  const auto load = [&](const std::int32_t* from) {
    return hn::BitCast(du, hn::LoadU(Int(), from));
  };
  const Words along_x = Enter(hn::Set(du, points.x), word(0)), last = Enter(hn::Zero(du), word(3));
  Many<kCount> a, b, c, d, bits;
  for (int k = 0; k < kCount; ++k) {
    a[k] = along_x, d[k] = last;
    b[k] = Enter(load(points.y + i + k * FloatLanes()), word(1));
    c[k] = Enter(load(points.z + i + k * FloatLanes()), word(2));
  }
  Mix<kCount>(a, b, c, d, bits);
  Kind::template FromBits<kCount>(bits, values);
}

// Four vectors at a time while there are so many, for the reason given at Many.
template <class Kind>
HWY_INLINE void PlaneOf(const StreamKey& key, const LatticePoints& points, std::ptrdiff_t count,
                        float* values) {
  constexpr int kTogether = 4;
  const std::ptrdiff_t lanes = FloatLanes();
  std::ptrdiff_t i = 0;
  for (; i + kTogether * lanes <= count; i += kTogether * lanes) {
    Floats found[kTogether];
    PointValues<Kind, kTogether>(key, points, i, found);
    for (int k = 0; k < kTogether; ++k) hn::StoreU(found[k], Float(), values + i + k * lanes);
  }
  for (; i < count; i += lanes) {
    Floats found[1];
    PointValues<Kind, 1>(key, points, i, found);
    StoreFirst(found[0], values + i, count - i);
  }
}

void Plane(const StreamKey& key, Distribution distribution, const LatticePoints& points, int count,
           float* values) {
  if (distribution == Distribution::normal)
    PlaneOf<Normal>(key, points, count, values);
  else
    PlaneOf<Uniform>(key, points, count, values);
}

HWY_INLINE Floats Lerp(Floats t, Floats a, Floats b) { return hn::MulAdd(t, hn::Sub(b, a), a); }

// Corner and fractions of one vector of lookups.
struct Cells {
  Cells(const LatticeCells& cells, std::ptrdiff_t i) {
    for (int axis = 0; axis < 3; ++axis) {
      corner[axis] = hn::BitCast(Word(), hn::LoadU(Int(), cells.corner[axis] + i));
      fraction[axis] = hn::LoadU(Float(), cells.fraction[axis] + i);
    }
  }
  Words corner[3];
  Floats fraction[3];
};

// The normals at the corners (x, y, z) of the cells, z fastest.
HWY_INLINE void CornerNormals(const Words (&key)[4], const Words (&corner)[3],
                              Floats (&normals)[8]) {
  const Word du;
  Words word[3][2];
  for (int axis = 0; axis < 3; ++axis) {
    word[axis][0] = Enter(corner[axis], key[axis]);
    word[axis][1] = Enter(hn::Add(corner[axis], hn::Set(du, 1)), key[axis]);
  }
  const Words last = Enter(hn::Zero(du), key[3]);
  Many<8> a, b, c, d, bits;
  for (int i = 0; i < 8; ++i)
    a[i] = word[0][i >> 2], b[i] = word[1][i >> 1 & 1], c[i] = word[2][i & 1], d[i] = last;
  Mix<8>(a, b, c, d, bits);
  NormalsFromBits<8>(bits, normals);
}

HWY_INLINE Floats Trilinear(const Floats (&fraction)[3], const Floats (&corner)[8]) {
  const auto along_z = [&](int i) { return Lerp(fraction[2], corner[i], corner[i + 1]); };
  const auto along_y = [&](int i) { return Lerp(fraction[1], along_z(i), along_z(i + 2)); };
  return Lerp(fraction[0], along_y(0), along_y(4));
}

HWY_INLINE Floats TrilinearNormals(const Words (&key)[4], const Cells& cells) {
  Floats normals[8];
  CornerNormals(key, cells.corner, normals);
  return Trilinear(cells.fraction, normals);
}

// The lattice points around some lookups.
struct Lattice {
  static constexpr int kMax = 128;

  std::int32_t low[3];
  int size[3];
  int count;
};

// Whether the lookups, at least one vector of them, have less than two lattice points each around
// them: then it pays to compute those once, instead of eight for each. They have where they are
// near each other against the cells.
HWY_INLINE bool ShareLattice(const LatticeCells& cells, std::ptrdiff_t count, Lattice& lattice) {
  const Int d;
  const std::ptrdiff_t lanes = FloatLanes();
  if (count < lanes) return false;
  const auto most = static_cast<std::uint32_t>(std::min<std::ptrdiff_t>(2 * count, Lattice::kMax));
  std::uint32_t points = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int32_t* corner = cells.corner[axis];
    Ints low = hn::LoadU(d, corner + count - lanes), high = low;
    for (std::ptrdiff_t i = 0; i + lanes < count; i += lanes) {
      low = hn::Min(low, hn::LoadU(d, corner + i));
      high = hn::Max(high, hn::LoadU(d, corner + i));
    }
    lattice.low[axis] = hn::GetLane(hn::MinOfLanes(d, low));
    const auto lowest = static_cast<std::uint32_t>(lattice.low[axis]);
    const std::uint32_t span =
        static_cast<std::uint32_t>(hn::GetLane(hn::MaxOfLanes(d, high))) - lowest;
    if (span >= most) return false;
    lattice.size[axis] = static_cast<int>(span + 2);
    points *= span + 2;
    if (points > most) return false;
  }
  lattice.count = static_cast<int>(points);
  return true;
}

// The normals of a lattice, z fastest, two vectors at a time.
HWY_INLINE void LatticeNormals(const Words (&key)[4], const Lattice& lattice, float* normals) {
  constexpr int kTogether = 2, kSlack = kTogether * hn::MaxLanes(Float());
  const Word du;
  HWY_ALIGN std::uint32_t place[3][Lattice::kMax + kSlack];
  int n = 0;
  for (int x = 0; x < lattice.size[0]; ++x)
    for (int y = 0; y < lattice.size[1]; ++y)
      for (int z = 0; z < lattice.size[2]; ++z, ++n) {
        const int step[3] = {x, y, z};
        for (int axis = 0; axis < 3; ++axis)
          place[axis][n] = static_cast<std::uint32_t>(lattice.low[axis]) +
                           static_cast<std::uint32_t>(step[axis]);
      }
  for (auto& axis : place) std::fill_n(axis + n, kSlack, 0u);
  const Words last = Enter(hn::Zero(du), key[3]);
  const std::ptrdiff_t lanes = FloatLanes();
  for (std::ptrdiff_t i = 0; i < n; i += kTogether * lanes) {
    Many<kTogether> a, b, c, d, bits;
    for (int k = 0; k < kTogether; ++k) {
      a[k] = Enter(hn::LoadU(du, place[0] + i + k * lanes), key[0]);
      b[k] = Enter(hn::LoadU(du, place[1] + i + k * lanes), key[1]);
      c[k] = Enter(hn::LoadU(du, place[2] + i + k * lanes), key[2]);
      d[k] = last;
    }
    Mix<kTogether>(a, b, c, d, bits);
    Floats values[kTogether];
    NormalsFromBits<kTogether>(bits, values);
    for (int k = 0; k < kTogether; ++k) hn::StoreU(values[k], Float(), normals + i + k * lanes);
  }
}

// The same values as one by one.
HWY_INLINE void SharedTrilinear(const Words (&key)[4], const Lattice& lattice,
                                const LatticeCells& cells, std::ptrdiff_t count, float* values) {
  const Float df;
  const Int di;
  HWY_ALIGN float normals[Lattice::kMax + 2 * hn::MaxLanes(df)];
  LatticeNormals(key, lattice, normals);
  const int row = lattice.size[2], plane = lattice.size[1] * row;
  const std::ptrdiff_t lanes = FloatLanes();
  for (std::ptrdiff_t next = 0; next < count; next += lanes) {
    const std::ptrdiff_t i = std::min(next, count - lanes);
    const auto step = [&](int axis) {
      return hn::Sub(hn::LoadU(di, cells.corner[axis] + i), hn::Set(di, lattice.low[axis]));
    };
    const Ints from = hn::Add(
        hn::Add(hn::Mul(step(0), hn::Set(di, plane)), hn::Mul(step(1), hn::Set(di, row))), step(2));
    Floats corner[8];
    for (int k = 0; k < 8; ++k)
      corner[k] =
          hn::GatherIndex(df, normals + (k >> 2) * plane + (k >> 1 & 1) * row + (k & 1), from);
    hn::StoreU(Trilinear(Cells(cells, i).fraction, corner), df, values + i);
  }
}

void TrilinearNormal(const StreamKey& key, const LatticeCells& cells, int count, float* values) {
  const Word d;
  const Words words[4] = {hn::Set(d, key.word[0]), hn::Set(d, key.word[1]), hn::Set(d, key.word[2]),
                          hn::Set(d, key.word[3])};
  Lattice lattice;
  if (ShareLattice(cells, count, lattice))
    return SharedTrilinear(words, lattice, cells, count, values);
  for (std::ptrdiff_t i = 0; i < count; i += FloatLanes())
    StoreFirst(TrilinearNormals(words, Cells(cells, i)), values + i, count - i);
}

void TrilinearNormalOfStreams(const StreamKeys& keys, const LatticeCells& cells, int count,
                              float* values) {
  const Word d;
  for (std::ptrdiff_t i = 0; i < count; i += FloatLanes()) {
    const Words words[4] = {hn::LoadU(d, keys.word[0] + i), hn::LoadU(d, keys.word[1] + i),
                            hn::LoadU(d, keys.word[2] + i), hn::LoadU(d, keys.word[3] + i)};
    StoreFirst(TrilinearNormals(words, Cells(cells, i)), values + i, count - i);
  }
}

#else

void Plane(const StreamKey& key, Distribution distribution, const LatticePoints& points, int count,
           float* values) {
  reference::plane(key, distribution, points, count, values);
}
void TrilinearNormal(const StreamKey& key, const LatticeCells& cells, int count, float* values) {
  reference::trilinear_normal(key, cells, count, values);
}
void TrilinearNormalOfStreams(const StreamKeys& keys, const LatticeCells& cells, int count,
                              float* values) {
  reference::trilinear_normal_of_streams(keys, cells, count, values);
}

#endif

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace solidtex::engine::solidtex_1 {

HWY_EXPORT(Plane);
HWY_EXPORT(TrilinearNormal);
HWY_EXPORT(TrilinearNormalOfStreams);

void plane(const StreamKey& key, Distribution distribution, const LatticePoints& points, int count,
           float* values) {
  HWY_DYNAMIC_DISPATCH(Plane)(key, distribution, points, count, values);
}

void trilinear_normal(const StreamKey& key, const LatticeCells& cells, int count, float* values) {
  HWY_DYNAMIC_DISPATCH(TrilinearNormal)(key, cells, count, values);
}

void trilinear_normal_of_streams(const StreamKeys& keys, const LatticeCells& cells, int count,
                                 float* values) {
  HWY_DYNAMIC_DISPATCH(TrilinearNormalOfStreams)(keys, cells, count, values);
}

}  // namespace solidtex::engine::solidtex_1
#endif
