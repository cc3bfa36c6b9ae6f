// Inner loop of convolutions: weighted sums of shifted runs. Included once per target.
#include <hwy/highway.h>

#include <algorithm>

#include "engine/kernels/linear_layer.h"
#include "engine/kernels/vector-inl.h"

#if defined(SOLIDTEX_LINEAR_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SOLIDTEX_LINEAR_INL_H
#undef SOLIDTEX_LINEAR_INL_H
#else
#define SOLIDTEX_LINEAR_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

#if SOLIDTEX_VECTOR_KERNELS

// A run of outputs: out[o * pitch + j] = layer of in[offsets[t] + j] for 0 <= j < count. Reads up
// to one vector beyond the input.
struct Run {
  const LinearLayer& layer;
  const std::ptrdiff_t* offsets;
  std::ptrdiff_t pitch;
};

// Sums fill half the registers: packs x 4 outputs x kVectors vectors.
inline constexpr int kTilePacks = HWY_TARGET == HWY_AVX2 ? 1 : 2;
inline constexpr int kTileVectors = 3;

// Computes one register tile: kPacks x 4 outputs from `first` on, kVectors vectors of the run.
template <int kPacks, int kVectors>
HWY_INLINE void Tile(const Run& run, int first, const float* HWY_RESTRICT in,
                     float* HWY_RESTRICT out, std::ptrdiff_t count) {
  constexpr int kPack = LinearLayer::kPack, kOutputs = kPacks * kPack;
  const Float d;
  const std::ptrdiff_t lanes = FloatLanes();
  const LinearLayer& layer = run.layer;
  Floats sum[kOutputs][kVectors];
  for (int o = 0; o < kOutputs; ++o)
    for (int v = 0; v < kVectors; ++v) sum[o][v] = hn::Set(d, layer.bias[first + o]);

  const float* HWY_RESTRICT weights = layer.packed.data() + layer.index(first, 0);
  const std::ptrdiff_t pack_stride = static_cast<std::ptrdiff_t>(layer.terms) * kPack;
  for (int t = 0; t < layer.terms; ++t, weights += kPack) {
    const float* from = in + run.offsets[t];
    Floats x[kVectors];
    for (int v = 0; v < kVectors; ++v) x[v] = hn::LoadU(d, from + v * lanes);
    for (int o = 0; o < kOutputs; ++o) {
      const Floats w = hn::Set(d, weights[o / kPack * pack_stride + o % kPack]);
      for (int v = 0; v < kVectors; ++v) sum[o][v] = FusedMulAdd(w, x[v], sum[o][v]);
    }
  }

  // Through memory, so that every index of `sum` is a constant and `sum` stays in registers.
  const Floats negative_slope = hn::Set(d, layer.negative_slope), zero = hn::Zero(d);
  HWY_ALIGN float results[kOutputs][kVectors * hn::MaxLanes(d)];
  for (int o = 0; o < kOutputs; ++o)
    for (int v = 0; v < kVectors; ++v) {
      const Floats s = sum[o][v];
      hn::Store(hn::IfThenElse(hn::Gt(s, zero), s, hn::Mul(negative_slope, s)), d,
                results[o] + v * lanes);
    }
  const int used = std::min(kOutputs, layer.outputs - first);
  for (int o = 0; o < used; ++o) std::copy_n(results[o], count, out + (first + o) * run.pitch);
}

template <int kVectors>
HWY_INLINE void AllOutputs(const Run& run, const float* in, float* out, std::ptrdiff_t count) {
  constexpr int kStep = kTilePacks * LinearLayer::kPack;
  int first = 0;
  for (; first + kStep <= run.layer.outputs; first += kStep)
    Tile<kTilePacks, kVectors>(run, first, in, out, count);
  for (; first < run.layer.outputs; first += LinearLayer::kPack)
    Tile<1, kVectors>(run, first, in, out, count);
}

HWY_INLINE void EvaluateRun(const Run& run, const float* in, float* out, std::ptrdiff_t count) {
  const std::ptrdiff_t lanes = FloatLanes();
  const std::ptrdiff_t step = kTileVectors * lanes;
  std::ptrdiff_t j = 0;
  for (; j + step <= count; j += step) AllOutputs<kTileVectors>(run, in + j, out + j, step);
  for (; j < count; j += lanes) AllOutputs<1>(run, in + j, out + j, std::min(lanes, count - j));
}

#endif  // SOLIDTEX_VECTOR_KERNELS

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
