#include "engine/sampler/octave.h"

#include "engine/kernels/targets.h"
// foreach_target.h includes this file once per target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/sampler/octave.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <cmath>

#include "engine/noise/hash.h"

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

#if HWY_NATIVE_FMA && HWY_HAVE_FLOAT64

namespace hn = hwy::HWY_NAMESPACE;

using Double = hn::ScalableTag<double>;
using Doubles = hn::Vec<Double>;

// Stores one vector of cells on one axis, from index i on.
HWY_INLINE void StoreCells(Doubles at, int axis, int i, OctaveCells& cells) {
  const Double d;
  const hn::Rebind<float, Double> df;
  const hn::Rebind<std::int32_t, Double> di;
  const auto period = hn::Set(d, 0x1p32), frequency = hn::Set(d, 0x1p-32);
  const auto whole = hn::Floor(at);
  hn::Store(hn::DemoteTo(df, hn::Sub(at, whole)), df, cells.fraction[axis] + i);
  if (hn::AllTrue(d, hn::Lt(hn::Abs(whole), hn::Set(d, 0x1p31)))) {  // nearly always
    return hn::Store(hn::DemoteTo(di, whole), di, cells.corner[axis] + i);
  }
  const auto rest = hn::Sub(whole, hn::Mul(hn::Floor(hn::Mul(whole, frequency)), period));
  // From [0, 2^32) to the signed number with the same low 32 bits.
  const auto above = hn::Ge(rest, hn::Set(d, 0x1p31)), inside = hn::Lt(rest, period);
  const auto wrapped = hn::Sub(rest, hn::IfThenElseZero(above, period));
  hn::Store(hn::DemoteTo(di, hn::IfThenElseZero(inside, wrapped)), di, cells.corner[axis] + i);
}

// Whole vectors: results beyond `count` are undefined.
void FindOctaveCells(const double* transform, const PlanarPositions& positions, int count,
                     OctaveCells& cells) {
  const Double d;
  for (int axis = 0; axis < 3; ++axis) {
    const auto tx = hn::Set(d, transform[3 * axis]), ty = hn::Set(d, transform[3 * axis + 1]),
               tz = hn::Set(d, transform[3 * axis + 2]);
    for (int p = 0; p < count; p += static_cast<int>(hn::Lanes(d))) {
      const auto x = hn::Load(d, positions.axis[0] + p), y = hn::Load(d, positions.axis[1] + p),
                 z = hn::Load(d, positions.axis[2] + p);
      StoreCells(hn::MulAdd(tz, z, hn::MulAdd(ty, y, hn::Mul(tx, x))), axis, p, cells);
    }
  }
}

void FindPointCells(const OctaveBank& bank, int first, int count, const double position[3],
                    OctaveCells& cells) {
  const Double d;
  const auto x = hn::Set(d, position[0]), y = hn::Set(d, position[1]), z = hn::Set(d, position[2]);
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
      const auto term = [&](int column) {
        return hn::LoadU(d, bank.transform[3 * axis + column].data() + first + i);
      };
      const auto at = hn::MulAdd(term(2), z, hn::MulAdd(term(1), y, hn::Mul(term(0), x)));
      StoreCells(at, axis, i, cells);
    }
  }
}

#else

void FindOctaveCells(const double* transform, const PlanarPositions& positions, int count,
                     OctaveCells& cells) {
  reference::find_octave_cells(transform, positions, count, cells);
}
void FindPointCells(const OctaveBank& bank, int first, int count, const double position[3],
                    OctaveCells& cells) {
  reference::find_point_cells(bank, first, count, position, cells);
}

#endif

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace solidtex::engine {

namespace {

// Returns a whole number modulo 2^32. Every step is exact. NaN gives 0.
std::int32_t wrap(double whole) {
  const double rest = whole - std::floor(whole * 0x1p-32) * 0x1p32;
  return rest < 0x1p32 ? static_cast<std::int32_t>(static_cast<std::uint32_t>(rest)) : 0;
}

void place(double at, int axis, int i, OctaveCells& cells) {
  const double whole = std::floor(at);
  cells.corner[axis][i] = wrap(whole);
  cells.fraction[axis][i] = static_cast<float>(at - whole);
}

}  // namespace

OctaveBank::OctaveBank(const Tensor& transforms, std::uint64_t seed)
    : count(static_cast<int>(transforms.shape[0])) {
  const std::size_t padded = (static_cast<std::size_t>(count) + kStep - 1) / kStep * kStep;
  for (auto& entries : transform) entries.resize(padded);
  for (auto& words : key) words.resize(padded);
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < 9; ++k) transform[k][i] = transforms.values[9 * i + k];
    const StreamKey stream = make_stream_key(seed, static_cast<std::uint32_t>(i), 0);
    for (int k = 0; k < 4; ++k) key[k][i] = stream.word[k];
  }
}

std::array<double, 9> OctaveBank::transform_of(int octave) const {
  std::array<double, 9> result;
  for (int k = 0; k < 9; ++k) result[k] = transform[k][octave];
  return result;
}

StreamKey OctaveBank::key_of(int octave) const {
  return {{key[0][octave], key[1][octave], key[2][octave], key[3][octave]}};
}

StreamKeys OctaveBank::keys(int first) const {
  return {{&key[0][first], &key[1][first], &key[2][first], &key[3][first]}};
}

void reference::find_octave_cells(const double* transform, const PlanarPositions& positions,
                                  int count, OctaveCells& cells) {
  const auto& [x, y, z] = positions.axis;
  for (int axis = 0; axis < 3; ++axis) {
    const double* row = transform + 3 * axis;
    for (int p = 0; p < count; ++p)
      place(std::fma(row[2], z[p], std::fma(row[1], y[p], row[0] * x[p])), axis, p, cells);
  }
}

void reference::find_point_cells(const OctaveBank& bank, int first, int count,
                                 const double position[3], OctaveCells& cells) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto* row = bank.transform + 3 * axis;
    for (int i = 0; i < count; ++i) {
      const double xy = std::fma(row[1][first + i], position[1], row[0][first + i] * position[0]);
      place(std::fma(row[2][first + i], position[2], xy), axis, i, cells);
    }
  }
}

HWY_EXPORT(FindOctaveCells);
HWY_EXPORT(FindPointCells);

void find_octave_cells(const double* transform, const PlanarPositions& positions, int count,
                       OctaveCells& cells) {
  HWY_DYNAMIC_DISPATCH(FindOctaveCells)(transform, positions, count, cells);
}

void find_point_cells(const OctaveBank& bank, int first, int count, const double position[3],
                      OctaveCells& cells) {
  HWY_DYNAMIC_DISPATCH(FindPointCells)(bank, first, count, position, cells);
}

}  // namespace solidtex::engine
#endif
