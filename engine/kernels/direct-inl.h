// 3^3 convolutions of few channels, tap by tap. Included once per target.
#include <hwy/highway.h>

#include <cmath>
#include <span>

#include "engine/kernels/channels-inl.h"
#include "engine/kernels/vector-inl.h"
#include "engine/kernels/winograd.h"
#include "engine/kernels/winograd_inputs-inl.h"
#include "engine/kernels/winograd_products-inl.h"

#if defined(SOLIDTEX_DIRECT_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SOLIDTEX_DIRECT_INL_H
#undef SOLIDTEX_DIRECT_INL_H
#else
#define SOLIDTEX_DIRECT_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

// Output of a vector of tiles: voxel p of output o goes to at[o * output + voxels[p]].
struct TapTarget {
  float* at;
  std::ptrdiff_t output;
  std::ptrdiff_t voxels[4];
};

#if SOLIDTEX_VECTOR_KERNELS

// Both z of some outputs of two vectors of tiles: 16 sums in 32 registers, or 8 in 16.
inline constexpr int kTapOutputs = HWY_TARGET == HWY_AVX2 ? 2 : 4;
inline constexpr int kTapVectors = 2;

template <int kVectors>
using TapSums = Floats[kTapOutputs][2][kVectors];

// Adds three taps along z of one input. `weights`: [z][4 outputs].
template <int kVectors, class Planes>
HWY_INLINE void AddRow(const Planes* tiles, int x, std::ptrdiff_t at,
                       const float* HWY_RESTRICT weights, TapSums<kVectors>& sum) {
  const Float d;
  Floats in[4][kVectors];
#pragma GCC unroll 2
  for (int v = 0; v < kVectors; ++v) {
#pragma GCC unroll 4
    for (int z = 0; z < 4; ++z) in[z][v] = tiles[v].Load(x, at + tiles[0].Z(z));
  }
#pragma GCC unroll 3
  for (int z = 0; z < 3; ++z)
#pragma GCC unroll 4
    for (int o = 0; o < kTapOutputs; ++o) {
      const Floats w = InRegister(hn::Set(d, weights[z * LinearLayer::kPack + o]));
#pragma GCC unroll 2
      for (int v = 0; v < kVectors; ++v) {
        sum[o][0][v] = FusedMulAdd(w, in[z][v], sum[o][0][v]);
        sum[o][1][v] = FusedMulAdd(w, in[z + 1][v], sum[o][1][v]);
      }
    }
}

// Computes some outputs from `first` on, at one y of the tiles and both z.
template <int kVectors, class Planes>
HWY_INLINE void TapTile(const LinearLayer& layer, const ConstPlanes& source, const Planes* tiles,
                        int y, int first, const TapTarget* targets) {
  const Float d;
  TapSums<kVectors> sum;
#pragma GCC unroll 4
  for (int o = 0; o < kTapOutputs; ++o)
#pragma GCC unroll 2
    for (int z = 0; z < 2; ++z)
#pragma GCC unroll 2
      for (int v = 0; v < kVectors; ++v) sum[o][z][v] = hn::Set(d, layer.bias[first + o]);
  const float* HWY_RESTRICT weights = layer.packed.data() + layer.index(first, 0);
  for (std::ptrdiff_t channel = 0; channel < source.plane_pitch();
       channel += source.channel_pitch())
    for (int x = 0; x < 3; ++x)
#pragma GCC unroll 3
      for (int dy = 0; dy < 3; ++dy, weights += 3 * LinearLayer::kPack)
        AddRow<kVectors>(tiles, x, tiles[0].Y(y + dy) + channel, weights, sum);
  const Floats negative_slope = hn::Set(d, layer.negative_slope);
#pragma GCC unroll 4
  for (int o = 0; o < kTapOutputs; ++o)
#pragma GCC unroll 2
    for (int z = 0; z < 2; ++z)
#pragma GCC unroll 2
      for (int v = 0; v < kVectors; ++v)
        hn::StoreU(Activate(sum[o][z][v], negative_slope), d,
                   targets[v].at + (first + o) * targets[v].output + targets[v].voxels[2 * y + z]);
}

template <int kVectors, bool kJoined>
void TapTiles(const LinearLayer& layer, const ConstPlanes& source, const TileVector* at, int origin,
              const TapTarget* targets) {
  TilePlanes<1, 3, kJoined> tiles[kVectors];
  for (int v = 0; v < kVectors; ++v) tiles[v] = {source, at[v], -1, origin};
  for (int first = 0; first < layer.outputs; first += kTapOutputs) {
    TapTile<kVectors>(layer, source, tiles, 0, first, targets);
    TapTile<kVectors>(layer, source, tiles, 1, first, targets);
  }
}

// Computes the four voxels of some vectors of tiles for all outputs, padded to kTapOutputs.
template <bool kJoined>
void SumTaps(const LinearLayer& layer, const ConstPlanes& source,
             std::span<const TileVector> vectors, int origin, const TapTarget* targets) {
  std::size_t i = 0;
  for (; i + kTapVectors <= vectors.size(); i += kTapVectors)
    TapTiles<kTapVectors, kJoined>(layer, source, &vectors[i], origin, targets + i);
  if (i < vectors.size()) TapTiles<1, kJoined>(layer, source, &vectors[i], origin, targets + i);
}

#else

// Without fused multiply-add instructions: the same sums one by one.
inline constexpr int kTapOutputs = 1;

template <bool kJoined>
void SumTaps(const LinearLayer& layer, const ConstPlanes& source,
             std::span<const TileVector> vectors, int origin, const TapTarget* targets) {
  constexpr std::size_t kLanes = hn::MaxLanes(Float());
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    const TilePlanes<1, 3, kJoined> tiles(source, vectors[i], -1, origin);
    for (int o = 0; o < layer.outputs; ++o)
      for (int p = 0; p < 4; ++p) {
        HWY_ALIGN float sum[kLanes], in[kLanes];
        std::fill_n(sum, kLanes, layer.bias[o]);
        for (int term = 0; term < layer.terms; ++term) {
          const int x = term / 9 % 3, y = p / 2 + term / 3 % 3, z = p % 2 + term % 3;
          const std::ptrdiff_t at = tiles.Y(y) + tiles.Z(z) + term / 27 * source.channel_pitch();
          hn::Store(tiles.Load(x, at), Float(), in);
          for (std::size_t t = 0; t < kLanes; ++t)
            sum[t] = std::fma(layer.weight(o, term), in[t], sum[t]);
        }
        float* to = targets[i].at + o * targets[i].output + targets[i].voxels[p];
        for (std::size_t t = 0; t < kLanes; ++t)
          to[t] = sum[t] > 0 ? sum[t] : layer.negative_slope * sum[t];
      }
  }
}

#endif

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
