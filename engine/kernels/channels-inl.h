// Weighted sums over channels for a strip of neighbouring values. Included once per target.
#include <hwy/highway.h>

#include <cmath>
#include <span>

#include "engine/kernels/vector-inl.h"
#include "engine/kernels/volume.h"
#include "engine/kernels/winograd.h"

#ifndef SOLIDTEX_CHANNELS_ONCE
#define SOLIDTEX_CHANNELS_ONCE
namespace solidtex::engine {

inline constexpr std::ptrdiff_t kStrip = 32;  // values in a strip: whole vectors on every target

// Some terms of a sum: input i is values[i * pitch + t], its weights are weights[i * padded + o].
struct TermRange {
  const float* weights;
  const float* values;
  int count;
  std::ptrdiff_t pitch;
};

// Where the sums go: out[o * pitch + t], for all padded outputs o.
struct SumTarget {
  float* out;
  std::ptrdiff_t pitch;
  int padded;
  const float* bias = nullptr;  // where sums start; none: zero, and no activation
  float slope = 1;
};

}  // namespace solidtex::engine
#endif

#if defined(SOLIDTEX_CHANNELS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SOLIDTEX_CHANNELS_INL_H
#undef SOLIDTEX_CHANNELS_INL_H
#else
#define SOLIDTEX_CHANNELS_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

HWY_INLINE Floats Activate(Floats v, Floats slope) {
  return hn::IfThenElse(hn::Gt(v, hn::Zero(Float())), v, hn::Mul(slope, v));
}

#if HWY_NATIVE_FMA

inline constexpr int kVectors = 2;
// Sums fill most of the registers: 24 of 32, or 12 of 16.
inline constexpr int kMostOutputs = (HWY_TARGET == HWY_AVX2 ? 12 : 24) / kVectors;

// `kOutputs` sums, from output `first` on, of two vectors of a strip.
template <int kOutputs>
HWY_INLINE void SumTile(std::span<const TermRange> ranges, const SumTarget& target, int first,
                        std::ptrdiff_t at) {
  const Float d;
  constexpr std::ptrdiff_t kLanes = hn::MaxLanes(d);
  Floats sum[kOutputs][kVectors];
#pragma GCC unroll 24
  for (int o = 0; o < kOutputs; ++o)
#pragma GCC unroll 4
    for (int v = 0; v < kVectors; ++v)
      sum[o][v] = hn::Set(d, target.bias ? target.bias[first + o] : 0.0f);
  for (const TermRange& range : ranges) {
    const float* HWY_RESTRICT weights = range.weights + first;
    const float* HWY_RESTRICT values = range.values + at;
    for (int i = 0; i < range.count; ++i, weights += target.padded, values += range.pitch) {
      Floats x[kVectors];
#pragma GCC unroll 4
      for (int v = 0; v < kVectors; ++v) x[v] = hn::Load(d, values + v * kLanes);
#pragma GCC unroll 24
      for (int o = 0; o < kOutputs; ++o) {
        const Floats w = hn::Set(d, weights[o]);
#pragma GCC unroll 4
        for (int v = 0; v < kVectors; ++v) sum[o][v] = hn::MulAdd(w, x[v], sum[o][v]);
      }
    }
  }
  float* HWY_RESTRICT out = target.out + first * target.pitch + at;
  const Floats slope = hn::Set(d, target.slope);
#pragma GCC unroll 24
  for (int o = 0; o < kOutputs; ++o)
#pragma GCC unroll 4
    for (int v = 0; v < kVectors; ++v)
      hn::Store(target.bias ? Activate(sum[o][v], slope) : sum[o][v], d,
                out + o * target.pitch + v * kLanes);
}

// The widest tile that fits what is left, from kOutputs down.
template <int kOutputs>
HWY_INLINE int WidestTile(std::span<const TermRange> ranges, const SumTarget& target, int first,
                          std::ptrdiff_t at) {
  if constexpr (kOutputs > 2) {
    if (target.padded - first < kOutputs)
      return WidestTile<kOutputs - 2>(ranges, target, first, at);
  }
  SumTile<kOutputs>(ranges, target, first, at);
  return first + kOutputs;
}

// The sums of a strip.
void Sums(std::span<const TermRange> ranges, const SumTarget& target) {
  for (std::ptrdiff_t at = 0; at < kStrip; at += kVectors * FloatLanes())
    for (int first = 0; first < target.padded;)
      first = WidestTile<kMostOutputs>(ranges, target, first, at);
}

#else

// Without fused multiply-add in the instruction set, the same sums one by one.
void Sums(std::span<const TermRange> ranges, const SumTarget& target) {
  for (int o = 0; o < target.padded; ++o)
    for (std::ptrdiff_t t = 0; t < kStrip; ++t) {
      float sum = target.bias ? target.bias[o] : 0;
      for (const TermRange& range : ranges)
        for (int i = 0; i < range.count; ++i)
          sum = std::fma(range.weights[i * target.padded + o], range.values[i * range.pitch + t],
                         sum);
      target.out[o * target.pitch + t] = !target.bias || sum > 0 ? sum : target.slope * sum;
    }
}

#endif

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
