// Dense layers on the active target: over a block of points, and for one point. See kernels.h.
#include "engine/kernels/targets.h"
// foreach_target.h includes this file once per target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/kernels/dense.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

#include "engine/kernels/kernels.h"
#include "engine/kernels/vector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

#if SOLIDTEX_VECTOR_KERNELS

// Two instructions suffice for 0 < negative_slope <= 1.
template <bool kUsualSlope>
HWY_INLINE Floats Activate(Floats sum, Floats negative_slope) {
  if (kUsualSlope) return hn::Max(hn::Mul(negative_slope, sum), sum);
  return hn::IfThenElse(hn::Gt(sum, hn::Zero(Float())), sum, hn::Mul(negative_slope, sum));
}

HWY_INLINE bool IsUsual(float negative_slope) { return 0 < negative_slope && negative_slope <= 1; }

// Vectors hold neighboring points; weights are broadcast. Whole vectors are stored directly from
// registers.
struct PointBlock {
  const LinearLayer& layer;
  const float* in;
  std::ptrdiff_t pitch;
  float* out;
};

// Computes one register tile: kPacks x 4 outputs from `first` on, kVectors vectors of points.
template <bool kUsualSlope, int kPacks, int kVectors>
HWY_INLINE void DenseTile(const PointBlock& block, int first, std::ptrdiff_t point) {
  constexpr int kPack = LinearLayer::kPack, kOutputs = kPacks * kPack;
  const Float d;
  const std::ptrdiff_t lanes = FloatLanes();
  const LinearLayer& layer = block.layer;
  Floats sum[kOutputs][kVectors];
  for (int o = 0; o < kOutputs; ++o)
    for (int v = 0; v < kVectors; ++v) sum[o][v] = hn::Set(d, layer.bias[first + o]);

  const float* HWY_RESTRICT weights = layer.packed.data() + layer.index(first, 0);
  const float* HWY_RESTRICT from = block.in + point;
  const std::ptrdiff_t pack_stride = static_cast<std::ptrdiff_t>(layer.terms) * kPack;
  for (int t = 0; t < layer.terms; ++t, weights += kPack, from += block.pitch) {
    Floats x[kVectors];
    for (int v = 0; v < kVectors; ++v) x[v] = hn::LoadU(d, from + v * lanes);
    for (int o = 0; o < kOutputs; ++o) {
      const Floats w = hn::Set(d, weights[o / kPack * pack_stride + o % kPack]);
      for (int v = 0; v < kVectors; ++v) sum[o][v] = FusedMulAdd(w, x[v], sum[o][v]);
    }
  }

  const Floats negative_slope = hn::Set(d, layer.negative_slope);
  float* HWY_RESTRICT to = block.out + first * block.pitch + point;
  for (int o = 0; o < kOutputs; ++o)
    for (int v = 0; v < kVectors; ++v)
      hn::StoreU(Activate<kUsualSlope>(sum[o][v], negative_slope), d,
                 to + o * block.pitch + v * lanes);
}

template <bool kUsualSlope, int kPacks, int kVectors>
HWY_INLINE void DenseOutputs(const PointBlock& block, std::ptrdiff_t point) {
  constexpr int kStep = kPacks * LinearLayer::kPack;
  int first = 0;
  for (; first + kStep <= block.layer.outputs; first += kStep)
    DenseTile<kUsualSlope, kPacks, kVectors>(block, first, point);
  for (; first < block.layer.outputs; first += LinearLayer::kPack)
    DenseTile<kUsualSlope, 1, kVectors>(block, first, point);
}

template <bool kUsualSlope>
HWY_INLINE void DensePoints(const PointBlock& block, int count) {
  // Sums fill three quarters of the registers: AVX2 has 16, other targets 32.
  constexpr int kPacks = HWY_TARGET == HWY_AVX2 ? 1 : 2;
  const std::ptrdiff_t lanes = FloatLanes();
  std::ptrdiff_t point = 0;
  for (; point + 2 * lanes < count; point += 3 * lanes)
    DenseOutputs<kUsualSlope, kPacks, 3>(block, point);
  if (point + lanes < count) {
    DenseOutputs<kUsualSlope, kPacks, 2>(block, point);
  } else if (point < count) {
    DenseOutputs<kUsualSlope, 2 * kPacks, 1>(block, point);
  }
}

void Dense(const LinearLayer& layer, const float* in, int count, std::ptrdiff_t pitch, float* out) {
  const PointBlock block{layer, in, pitch, out};
  if (IsUsual(layer.negative_slope)) {
    DensePoints<true>(block, count);
  } else {
    DensePoints<false>(block, count);
  }
}

// Vectors hold neighboring outputs; inputs are broadcast. The sums are those of Dense.
template <bool kUsualSlope, int kVectors>
HWY_INLINE void PointTile(const PointLayer& layer, int first, const float* in, float* out) {
  const Float d;
  const std::ptrdiff_t lanes = FloatLanes();
  Floats sum[kVectors];
  for (int v = 0; v < kVectors; ++v) sum[v] = hn::LoadU(d, &layer.bias[first] + v * lanes);
  const float* HWY_RESTRICT weights = layer.weights.get() + first;
  for (int t = 0; t < layer.terms; ++t, weights += layer.pitch) {
    const Floats x = hn::Set(d, in[t]);
    for (int v = 0; v < kVectors; ++v)
      sum[v] = FusedMulAdd(hn::LoadU(d, weights + v * lanes), x, sum[v]);
  }
  const Floats negative_slope = hn::Set(d, layer.negative_slope);
  for (int v = 0; v < kVectors; ++v)
    hn::StoreU(Activate<kUsualSlope>(sum[v], negative_slope), d, out + first + v * lanes);
}

template <bool kUsualSlope>
HWY_INLINE void PointOutputs(const PointLayer& layer, const float* in, float* out) {
  constexpr int kVectors = 8;  // enough chains to hide the latency of an addition
  const auto lanes = static_cast<int>(FloatLanes());
  int first = 0;
  for (; first + kVectors * lanes <= layer.pitch; first += kVectors * lanes)
    PointTile<kUsualSlope, kVectors>(layer, first, in, out);
  for (; first < layer.pitch; first += lanes) PointTile<kUsualSlope, 1>(layer, first, in, out);
}

void DensePoint(const PointLayer& layer, const float* in, float* out) {
  if (IsUsual(layer.negative_slope)) {
    PointOutputs<true>(layer, in, out);
  } else {
    PointOutputs<false>(layer, in, out);
  }
}

void ActivateDerivatives(const LinearLayer& layer, const float* units, std::ptrdiff_t unit_pitch,
                         std::ptrdiff_t pitch, float* derivatives) {
  const Float d;
  const Floats one = hn::Set(d, 1), negative_slope = hn::Set(d, layer.negative_slope),
               zero = hn::Zero(d);
  for (int o = 0; o < layer.outputs; ++o, units += unit_pitch, derivatives += 3 * pitch)
    for (std::ptrdiff_t p = 0; p < pitch; p += FloatLanes()) {
      const Floats factor =
          hn::IfThenElse(hn::Gt(hn::LoadU(d, units + p), zero), one, negative_slope);
      for (int axis = 0; axis < 3; ++axis) {
        float* at = derivatives + axis * pitch + p;
        hn::StoreU(hn::Mul(hn::LoadU(d, at), factor), d, at);
      }
    }
}

#else

void Dense(const LinearLayer& layer, const float* in, int count, std::ptrdiff_t pitch, float* out) {
  reference::dense(layer, in, count, pitch, out);
}
void DensePoint(const PointLayer& layer, const float* in, float* out) {
  reference::dense_point(layer, in, out);
}
void ActivateDerivatives(const LinearLayer& layer, const float* units, std::ptrdiff_t unit_pitch,
                         std::ptrdiff_t pitch, float* derivatives) {
  reference::activate_derivatives(layer, units, unit_pitch, pitch, derivatives);
}

#endif

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace solidtex::engine::kernels {

HWY_EXPORT(Dense);
HWY_EXPORT(DensePoint);
HWY_EXPORT(ActivateDerivatives);

void dense(const LinearLayer& layer, const float* in, int count, std::ptrdiff_t pitch, float* out) {
  HWY_DYNAMIC_DISPATCH(Dense)(layer, in, count, pitch, out);
}

void dense_point(const PointLayer& layer, const float* in, float* out) {
  HWY_DYNAMIC_DISPATCH(DensePoint)(layer, in, out);
}

void activate_derivatives(const LinearLayer& layer, const float* units, std::ptrdiff_t unit_pitch,
                          std::ptrdiff_t pitch, float* derivatives) {
  HWY_DYNAMIC_DISPATCH(ActivateDerivatives)(layer, units, unit_pitch, pitch, derivatives);
}

}  // namespace solidtex::engine::kernels
#endif
