// Trilinear lookups of the scheme solidtex-1 on the active target.
#include "engine/kernels/targets.h"
#include "engine/noise/solidtex_1.h"
// foreach_target.h includes this file once per target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/noise/trilinear.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

#include "engine/noise/solidtex_1-inl.h"

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

#if SOLIDTEX_VECTOR_KERNELS

HWY_INLINE Floats Lerp(Floats t, Floats a, Floats b) { return FusedMulAdd(t, hn::Sub(b, a), a); }

// Corners and fractions of one vector of lookups.
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

// Normals at the corners (x, y, z) of the cells, z fastest.
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

// Stores the values of one vector of lookups.
struct StoreValues {
  HWY_INLINE void operator()(const Floats (&fraction)[3], const Floats (&corner)[8],
                             std::ptrdiff_t i, std::ptrdiff_t count) const {
    StoreFirst(Trilinear(fraction, corner), values + i, count);
  }
  float* values;
};

// Stores values and derivatives.
struct StoreDerivatives {
  HWY_INLINE void operator()(const Floats (&fraction)[3], const Floats (&corner)[8],
                             std::ptrdiff_t i, std::ptrdiff_t count) const {
    const auto& [x, y, z] = fraction;
    Floats edge[4], side[2], step[3];  // along z, along z and y; derivatives per fraction
    for (int k = 0; k < 4; ++k) edge[k] = Lerp(z, corner[2 * k], corner[2 * k + 1]);
    for (int k = 0; k < 2; ++k) side[k] = Lerp(y, edge[2 * k], edge[2 * k + 1]);
    const auto rise = [&](int k) { return hn::Sub(corner[2 * k + 1], corner[2 * k]); };
    step[0] = hn::Sub(side[1], side[0]);
    step[1] = Lerp(x, hn::Sub(edge[1], edge[0]), hn::Sub(edge[3], edge[2]));
    step[2] = Lerp(x, Lerp(y, rise(0), rise(1)), Lerp(y, rise(2), rise(3)));
    StoreFirst(Lerp(x, side[0], side[1]), values + i, count);
    const Float d;
    for (int axis = 0; axis < 3; ++axis) {
      const auto entry = [&](int row) { return hn::Set(d, transform[3 * row + axis]); };
      const Floats first = hn::Mul(entry(0), step[0]);
      const Floats derivative =
          FusedMulAdd(entry(2), step[2], FusedMulAdd(entry(1), step[1], first));
      StoreFirst(derivative, derivatives[axis] + i, count);
    }
  }
  const float* transform;
  float* values;
  float* const* derivatives;
};

// Lattice points around some lookups.
struct Lattice {
  static constexpr int kMax = 128;

  std::int32_t low[3];
  int size[3];
  int count;
};

// Returns whether lookups, at least one vector of them, share lattice points so much that there are
// fewer than two per lookup. Then the points are computed once, not eight times per lookup. This
// holds for lookups that are close together compared with the cells.
HWY_INLINE bool ShareLattice(const LatticeCells& cells, std::ptrdiff_t count, Lattice& lattice) {
  const Int d;
  const std::ptrdiff_t lanes = FloatLanes();
  if (count < lanes) return false;
  const auto max_points =
      static_cast<std::uint32_t>(std::min<std::ptrdiff_t>(2 * count, Lattice::kMax));
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
    if (span >= max_points) return false;
    lattice.size[axis] = static_cast<int>(span + 2);
    points *= span + 2;
    if (points > max_points) return false;
  }
  lattice.count = static_cast<int>(points);
  return true;
}

// Computes the normals of a lattice, z fastest, two vectors at a time.
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

// Computes the values of LookUp from shared lattice points.
template <class Store>
HWY_INLINE void SharedTrilinear(const Words (&key)[4], const Lattice& lattice,
                                const LatticeCells& cells, std::ptrdiff_t count,
                                const Store& store) {
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
    store(Cells(cells, i).fraction, corner, i, lanes);
  }
}

template <class Store>
HWY_INLINE void LookUp(const StreamKey& key, const LatticeCells& cells, int count,
                       const Store& store) {
  const Word d;
  const Words words[4] = {hn::Set(d, key.word[0]), hn::Set(d, key.word[1]), hn::Set(d, key.word[2]),
                          hn::Set(d, key.word[3])};
  Lattice lattice;
  if (ShareLattice(cells, count, lattice))
    return SharedTrilinear(words, lattice, cells, count, store);
  for (std::ptrdiff_t i = 0; i < count; i += FloatLanes()) {
    const Cells found(cells, i);
    Floats normals[8];
    CornerNormals(words, found.corner, normals);
    store(found.fraction, normals, i, count - i);
  }
}

void TrilinearNormal(const StreamKey& key, const LatticeCells& cells, int count, float* values) {
  LookUp(key, cells, count, StoreValues{values});
}

void TrilinearNormalDerivatives(const StreamKey& key, const LatticeCells& cells,
                                const float* transform, int count, float* values,
                                float* const* derivatives) {
  LookUp(key, cells, count, StoreDerivatives{transform, values, derivatives});
}

void TrilinearNormalOfStreams(const StreamKeys& keys, const LatticeCells& cells, int count,
                              float* values) {
  const Word d;
  for (std::ptrdiff_t i = 0; i < count; i += FloatLanes()) {
    const Words words[4] = {hn::LoadU(d, keys.word[0] + i), hn::LoadU(d, keys.word[1] + i),
                            hn::LoadU(d, keys.word[2] + i), hn::LoadU(d, keys.word[3] + i)};
    const Cells found(cells, i);
    Floats normals[8];
    CornerNormals(words, found.corner, normals);
    StoreFirst(Trilinear(found.fraction, normals), values + i, count - i);
  }
}

#else

void TrilinearNormal(const StreamKey& key, const LatticeCells& cells, int count, float* values) {
  reference::trilinear_normal(key, cells, count, values);
}
void TrilinearNormalDerivatives(const StreamKey& key, const LatticeCells& cells,
                                const float* transform, int count, float* values,
                                float* const* derivatives) {
  reference::trilinear_normal_derivatives(key, cells, transform, count, values, derivatives);
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

HWY_EXPORT(TrilinearNormal);
HWY_EXPORT(TrilinearNormalDerivatives);
HWY_EXPORT(TrilinearNormalOfStreams);

void trilinear_normal(const StreamKey& key, const LatticeCells& cells, int count, float* values) {
  HWY_DYNAMIC_DISPATCH(TrilinearNormal)(key, cells, count, values);
}

void trilinear_normal_derivatives(const StreamKey& key, const LatticeCells& cells,
                                  const float* transform, int count, float* values,
                                  float* const* derivatives) {
  HWY_DYNAMIC_DISPATCH(TrilinearNormalDerivatives)
  (key, cells, transform, count, values, derivatives);
}

void trilinear_normal_of_streams(const StreamKeys& keys, const LatticeCells& cells, int count,
                                 float* values) {
  HWY_DYNAMIC_DISPATCH(TrilinearNormalOfStreams)(keys, cells, count, values);
}

}  // namespace solidtex::engine::solidtex_1
#endif
