#include "engine/sampler/octave.h"

#include "engine/kernels/targets.h"
// foreach_target.h includes this file once per target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/sampler/octave.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <cmath>

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

#if HWY_NATIVE_FMA && HWY_HAVE_FLOAT64

namespace hn = hwy::HWY_NAMESPACE;

// Whole blocks: what is computed behind `count` is never read as a result.
void FindOctaveCells(const double* transform, const PlanarPositions& positions, int count,
                     OctaveCells& cells) {
  const hn::ScalableTag<double> d;
  const hn::Rebind<float, decltype(d)> df;
  const hn::Rebind<std::int32_t, decltype(d)> di;
  const auto period = hn::Set(d, 0x1p32), frequency = hn::Set(d, 0x1p-32);
  for (int axis = 0; axis < 3; ++axis) {
    const auto tx = hn::Set(d, transform[3 * axis]), ty = hn::Set(d, transform[3 * axis + 1]),
               tz = hn::Set(d, transform[3 * axis + 2]);
    for (int p = 0; p < count; p += static_cast<int>(hn::Lanes(d))) {
      const auto x = hn::Load(d, positions.axis[0] + p), y = hn::Load(d, positions.axis[1] + p),
                 z = hn::Load(d, positions.axis[2] + p);
      const auto at = hn::MulAdd(tz, z, hn::MulAdd(ty, y, hn::Mul(tx, x)));
      const auto whole = hn::Floor(at);
      hn::Store(hn::DemoteTo(df, hn::Sub(at, whole)), df, cells.fraction[axis] + p);
      const auto rest = hn::Sub(whole, hn::Mul(hn::Floor(hn::Mul(whole, frequency)), period));
      // From [0, 2^32) to the signed number with the same low 32 bits.
      const auto above = hn::Ge(rest, hn::Set(d, 0x1p31)), inside = hn::Lt(rest, period);
      const auto wrapped = hn::Sub(rest, hn::IfThenElseZero(above, period));
      hn::Store(hn::DemoteTo(di, hn::IfThenElseZero(inside, wrapped)), di, cells.corner[axis] + p);
    }
  }
}

#else

void FindOctaveCells(const double* transform, const PlanarPositions& positions, int count,
                     OctaveCells& cells) {
  reference::find_octave_cells(transform, positions, count, cells);
}

#endif

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace solidtex::engine {

namespace {

// A whole number modulo 2^32; every step is exact. What is not a number gives 0.
std::int32_t wrap(double whole) {
  const double rest = whole - std::floor(whole * 0x1p-32) * 0x1p32;
  return rest < 0x1p32 ? static_cast<std::int32_t>(static_cast<std::uint32_t>(rest)) : 0;
}

}  // namespace

void reference::find_octave_cells(const double* transform, const PlanarPositions& positions,
                                  int count, OctaveCells& cells) {
  const auto& [x, y, z] = positions.axis;
  for (int axis = 0; axis < 3; ++axis) {
    const double* row = transform + 3 * axis;
    for (int p = 0; p < count; ++p) {
      const double at = std::fma(row[2], z[p], std::fma(row[1], y[p], row[0] * x[p]));
      const double whole = std::floor(at);
      cells.corner[axis][p] = wrap(whole);
      cells.fraction[axis][p] = static_cast<float>(at - whole);
    }
  }
}

HWY_EXPORT(FindOctaveCells);

void find_octave_cells(const double* transform, const PlanarPositions& positions, int count,
                       OctaveCells& cells) {
  HWY_DYNAMIC_DISPATCH(FindOctaveCells)(transform, positions, count, cells);
}

}  // namespace solidtex::engine
#endif
