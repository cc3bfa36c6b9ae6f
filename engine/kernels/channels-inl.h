// Dense layers over the channels of a strip of values. Included once per target.
#include <hwy/highway.h>

#include <cmath>

#include "engine/kernels/vector-inl.h"
#include "engine/kernels/winograd.h"

#ifndef SOLIDTEX_CHANNELS_ONCE
#define SOLIDTEX_CHANNELS_ONCE
namespace solidtex::engine {

inline constexpr std::ptrdiff_t kStrip = 32;  // values per strip: pairs of vectors on every target

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

HWY_INLINE Floats Activate(Floats v, Floats negative_slope) {
  return hn::IfThenElse(hn::Gt(v, hn::Zero(Float())), v, hn::Mul(negative_slope, v));
}

#if SOLIDTEX_VECTOR_KERNELS

// Sums of two vectors fill most registers: 24 of 32, or 12 of 16.
inline constexpr int kMaxChannels = HWY_TARGET == HWY_AVX2 ? 6 : 12;

// Computes kOutputs outputs of some vectors, from output `first` on.
template <int kOutputs, int kVectors>
HWY_INLINE void ChannelTile(const ChannelLayer& layer, int first, const float* HWY_RESTRICT in,
                            std::ptrdiff_t pitch, float* HWY_RESTRICT out,
                            std::ptrdiff_t out_pitch) {
  const Float d;
  constexpr std::ptrdiff_t kLanes = hn::MaxLanes(d);
  Floats sum[kOutputs][kVectors];
#pragma GCC unroll 12
  for (int o = 0; o < kOutputs; ++o)
#pragma GCC unroll 2
    for (int v = 0; v < kVectors; ++v) sum[o][v] = hn::Set(d, layer.bias[first + o]);
  const float* HWY_RESTRICT weights = layer.weights.data() + first;
  for (int i = 0; i < layer.inputs; ++i, weights += layer.padded, in += pitch) {
    Floats x[kVectors];
#pragma GCC unroll 2
    for (int v = 0; v < kVectors; ++v) x[v] = hn::Load(d, in + v * kLanes);
#pragma GCC unroll 12
    for (int o = 0; o < kOutputs; ++o) {
      const Floats w = hn::Set(d, weights[o]);
#pragma GCC unroll 2
      for (int v = 0; v < kVectors; ++v) sum[o][v] = FusedMulAdd(w, x[v], sum[o][v]);
    }
  }
  const Floats negative_slope = hn::Set(d, layer.negative_slope);
  out += first * out_pitch;
#pragma GCC unroll 12
  for (int o = 0; o < kOutputs; ++o, out += out_pitch)
#pragma GCC unroll 2
    for (int v = 0; v < kVectors; ++v)
      hn::Store(Activate(sum[o][v], negative_slope), d, out + v * kLanes);
}

// Computes the widest tile that fits, up to kOutputs. Returns the next output.
template <int kOutputs, int kVectors>
HWY_INLINE int WidestChannelTile(const ChannelLayer& layer, int first, const float* in,
                                 std::ptrdiff_t pitch, float* out, std::ptrdiff_t out_pitch) {
  if constexpr (kOutputs > 2) {
    if (layer.padded - first < kOutputs)
      return WidestChannelTile<kOutputs - 2, kVectors>(layer, first, in, pitch, out, out_pitch);
  }
  ChannelTile<kOutputs, kVectors>(layer, first, in, pitch, out, out_pitch);
  return first + kOutputs;
}

template <int kVectors>
void ChannelTiles(const ChannelLayer& layer, const float* in, std::ptrdiff_t pitch, float* out,
                  std::ptrdiff_t out_pitch) {
  for (int first = 0; first < layer.padded;)
    first = WidestChannelTile<kMaxChannels, kVectors>(layer, first, in, pitch, out, out_pitch);
}

// Computes all padded outputs of `count` values in whole vectors. Channels are `pitch` apart.
void Channels(const ChannelLayer& layer, const float* in, std::ptrdiff_t pitch,
              std::ptrdiff_t count, float* out, std::ptrdiff_t out_pitch) {
  const std::ptrdiff_t lanes = FloatLanes();
  std::ptrdiff_t t = 0;
  for (; t + lanes < count; t += 2 * lanes)
    ChannelTiles<2>(layer, in + t, pitch, out + t, out_pitch);
  if (t < count) ChannelTiles<1>(layer, in + t, pitch, out + t, out_pitch);
}

#else

// Without fused multiply-add instructions: the same sums one by one.
void Channels(const ChannelLayer& layer, const float* in, std::ptrdiff_t pitch,
              std::ptrdiff_t count, float* out, std::ptrdiff_t out_pitch) {
  for (int o = 0; o < layer.outputs; ++o)
    for (std::ptrdiff_t t = 0; t < count; ++t) {
      float sum = layer.bias[o];
      for (int i = 0; i < layer.inputs; ++i)
        sum = std::fma(layer.weights[i * layer.padded + o], in[i * pitch + t], sum);
      out[o * out_pitch + t] = sum > 0 ? sum : layer.negative_slope * sum;
    }
}

#endif

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
