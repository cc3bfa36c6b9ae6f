// Planes of the scheme solidtex-1 on the active target.
#include "engine/noise/solidtex_1.h"

#include "engine/kernels/targets.h"
// foreach_target.h includes this file once per target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/noise/solidtex_1.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "engine/noise/solidtex_1-inl.h"

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

#if SOLIDTEX_VECTOR_KERNELS

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

// Computes kCount vectors of points from point i on.
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

// Computes four vectors at a time while there are enough. See Many.
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
#else

void Plane(const StreamKey& key, Distribution distribution, const LatticePoints& points, int count,
           float* values) {
  reference::plane(key, distribution, points, count, values);
}

#endif

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace solidtex::engine::solidtex_1 {

HWY_EXPORT(Plane);

void plane(const StreamKey& key, Distribution distribution, const LatticePoints& points, int count,
           float* values) {
  HWY_DYNAMIC_DISPATCH(Plane)(key, distribution, points, count, values);
}

}  // namespace solidtex::engine::solidtex_1
#endif
