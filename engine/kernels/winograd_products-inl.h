// Products of a Winograd convolution and their transform to voxels. Included once per target.
#include <hwy/highway.h>

#include <cmath>
#include <span>

#include "engine/kernels/channels-inl.h"
#include "engine/kernels/vector-inl.h"
#include "engine/kernels/winograd.h"
#include "engine/kernels/winograd_transforms-inl.h"

#if defined(SOLIDTEX_WINOGRAD_PRODUCTS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SOLIDTEX_WINOGRAD_PRODUCTS_INL_H
#undef SOLIDTEX_WINOGRAD_PRODUCTS_INL_H
#else
#define SOLIDTEX_WINOGRAD_PRODUCTS_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

// Some of the input channels of four products (ix, iy, 0 .. 3).
struct ProductTerms {
  const float* weights;  // [input][output][iz]
  const float* values;   // [iz][tile] of each input
  std::ptrdiff_t pitch;  // from one input to the next
  int count;
  bool upsampled;  // values have iz 0 and 1 only: none at 2, and 3 equals 0
};

#if SOLIDTEX_VECTOR_KERNELS

// Two vectors of tiles at a time, one where there are 16 registers.
inline constexpr int kProductVectors = HWY_TARGET == HWY_AVX2 ? 1 : 2;

// Sums of the products kZ .. kZ + kCount - 1: 24 of 32 registers, or 12 of 16.
template <int kOutputs, int kCount, int kVectors>
using ProductSums = Floats[kOutputs][kCount][kVectors];

template <int kOutputs, int kZ, int kCount, int kVectors, bool kUpsampled>
HWY_INLINE void Accumulate(const ProductTerms& terms, int outputs, int first, std::ptrdiff_t at,
                           ProductSums<kOutputs, kCount, kVectors>& sum) {
  const Float d;
  const float* HWY_RESTRICT weights = terms.weights + 4 * first + kZ;
  const float* HWY_RESTRICT values = terms.values + at;
  for (int i = 0; i < terms.count; ++i, weights += 4 * outputs, values += terms.pitch) {
#pragma GCC unroll 4
    for (int z = 0; z < kCount; ++z) {
      if (kUpsampled && kZ + z == 2) continue;
      const int from = kUpsampled && kZ + z == 3 ? 0 : kZ + z;
      Floats x[kVectors];
#pragma GCC unroll 2
      for (int v = 0; v < kVectors; ++v)
        x[v] = InRegister(hn::Load(d, values + from * kStrip + v * hn::MaxLanes(d)));
#pragma GCC unroll 6
      for (int o = 0; o < kOutputs; ++o) {
        const Floats w = hn::Set(d, weights[4 * o + z]);
#pragma GCC unroll 2
        for (int v = 0; v < kVectors; ++v) sum[o][z][v] = FusedMulAdd(w, x[v], sum[o][z][v]);
      }
    }
  }
}

// Transforms products to both voxels along z: m0 + m1 + m2 and m1 - m2 - m3. Takes all four
// products, or begins with the first two and finishes with the others.
template <int kZ>
HWY_INLINE void StoreAlongZ(const Floats (&m)[4], float* HWY_RESTRICT low) {
  const Float d;
  Floats z[2];
  TransformOutput(m, z);
  hn::Store(InRegister(z[0]), d, low);
  hn::Store(InRegister(z[1]), d, low + kStrip);
}
template <int kZ>
HWY_INLINE void StoreAlongZ(const Floats (&m)[2], float* HWY_RESTRICT low) {
  const Float d;
  float* high = low + kStrip;
  if constexpr (kZ == 0) {
    hn::Store(InRegister(hn::Add(m[0], m[1])), d, low);
    hn::Store(InRegister(m[1]), d, high);
  } else {
    hn::Store(InRegister(hn::Add(hn::Load(d, low), m[0])), d, low);
    hn::Store(InRegister(hn::Sub(hn::Sub(hn::Load(d, high), m[0]), m[1])), d, high);
  }
}

template <int kOutputs, int kZ, int kCount, int kVectors>
HWY_INLINE void ProductTile(std::span<const ProductTerms> terms, int outputs, int first,
                            std::ptrdiff_t at, float* HWY_RESTRICT out) {
  const Float d;
  ProductSums<kOutputs, kCount, kVectors> sum;
#pragma GCC unroll 6
  for (int o = 0; o < kOutputs; ++o)
#pragma GCC unroll 4
    for (int z = 0; z < kCount; ++z)
#pragma GCC unroll 2
      for (int v = 0; v < kVectors; ++v) sum[o][z][v] = hn::Zero(d);
  for (const ProductTerms& part : terms) {
    if (part.upsampled)
      Accumulate<kOutputs, kZ, kCount, kVectors, true>(part, outputs, first, at, sum);
    else
      Accumulate<kOutputs, kZ, kCount, kVectors, false>(part, outputs, first, at, sum);
  }
  out += 8 * first * kStrip + at;
#pragma GCC unroll 6
  for (int o = 0; o < kOutputs; ++o, out += 8 * kStrip)
#pragma GCC unroll 2
    for (int v = 0; v < kVectors; ++v) {
      Floats m[kCount];
#pragma GCC unroll 4
      for (int z = 0; z < kCount; ++z) m[z] = sum[o][z][v];
      StoreAlongZ<kZ>(m, out + v * hn::MaxLanes(d));
    }
}

// Computes four products of three outputs (20 loads for 24 multiplications) or, where a group has
// many terms, two products of six outputs twice (16 loads). See
// docs/experiments/engine-constants.md.
template <int kVectors>
void ProductTiles(std::span<const ProductTerms> terms, int outputs, std::ptrdiff_t at,
                  float* HWY_RESTRICT out) {
  const bool in_halves = terms.size() == 1 && !terms[0].upsampled && terms[0].count >= 16;
  int first = 0;
  if (in_halves)
    for (; first + 6 <= outputs; first += 6) {
      ProductTile<6, 0, 2, kVectors>(terms, outputs, first, at, out);
      ProductTile<6, 2, 2, kVectors>(terms, outputs, first, at, out);
    }
  for (; first + 3 <= outputs; first += 3)
    ProductTile<3, 0, 4, kVectors>(terms, outputs, first, at, out);
  if (first + 2 == outputs) ProductTile<2, 0, 4, kVectors>(terms, outputs, first, at, out);
  if (first + 1 == outputs) ProductTile<1, 0, 4, kVectors>(terms, outputs, first, at, out);
}

// Computes the products (ix, iy, 0 .. 3) of `count` tiles, summed over the terms and transformed
// along z. Output o has its two values at out[8 o * kStrip] and out[(8 o + 1) * kStrip].
void Products(std::span<const ProductTerms> terms, int outputs, std::ptrdiff_t count, float* out) {
  const std::ptrdiff_t lanes = FloatLanes();
  std::ptrdiff_t at = 0;
  for (; at + (kProductVectors - 1) * lanes < count; at += kProductVectors * lanes)
    ProductTiles<kProductVectors>(terms, outputs, at, out);
  if (at < count) ProductTiles<1>(terms, outputs, at, out);
}

#else

// Without fused multiply-add instructions: the same sums one by one.
void Products(std::span<const ProductTerms> terms, int outputs, std::ptrdiff_t count, float* out) {
  for (int o = 0; o < outputs; ++o)
    for (std::ptrdiff_t t = 0; t < count; ++t) {
      float sum[4] = {};
      for (const ProductTerms& part : terms) {
        const auto from = [&part](int z) { return part.upsampled && z == 3 ? 0 : z; };
        for (int i = 0; i < part.count; ++i)
          for (int z = 0; z < 4; ++z)
            if (!part.upsampled || z != 2)
              sum[z] = std::fma(part.weights[(i * outputs + o) * 4 + z],
                                part.values[i * part.pitch + from(z) * kStrip + t], sum[z]);
      }
      out[8 * o * kStrip + t] = (sum[0] + sum[1]) + sum[2];
      out[(8 * o + 1) * kStrip + t] = (sum[1] - sum[2]) - sum[3];
    }
}

#endif

// Transforms the products of one x position along y. Position (iy, z) of output o is
// products[(8 o + 2 iy + z) * kStrip], its y go to out[(kSlots o + 2 y + z) * kStrip].
template <int kTile>
void OutputAlongY(int outputs, std::ptrdiff_t count, const float* HWY_RESTRICT products,
                  float* HWY_RESTRICT out) {
  const Float d;
  for (int o = 0; o < outputs; ++o, products += 8 * kStrip, out += kSlots<kTile> * kStrip)
    for (std::ptrdiff_t t = 0; t < count; t += hn::MaxLanes(d))
#pragma GCC unroll 2
      for (int z = 0; z < 2; ++z) {
        Floats m[4], y[2];
#pragma GCC unroll 4
        for (int i = 0; i < 4; ++i) m[i] = hn::Load(d, products + (2 * i + z) * kStrip + t);
        TransformOutput(m, y);
        hn::Store(y[0], d, out + z * kStrip + t);
        hn::Store(y[1], d, out + (2 + z) * kStrip + t);
      }
}

// Transforms all slots along x, in place, and finishes the voxels with bias and activation.
template <int kTile>
void OutputAlongX(const WinogradLayer& layer, std::ptrdiff_t count, float* HWY_RESTRICT slots) {
  const Float d;
  const Floats negative_slope = hn::Set(d, layer.negative_slope);
  for (int o = 0; o < layer.outputs; ++o, slots += kSlots<kTile> * kStrip) {
    const Floats bias = hn::Set(d, layer.bias[o]);
    for (int yz = 0; yz < 4; ++yz)
      for (std::ptrdiff_t t = 0; t < count; t += hn::MaxLanes(d)) {
        float* at = slots + yz * kStrip + t;
        Floats m[kTile + 2], x[kTile];
#pragma GCC unroll 6
        for (int i = 0; i < kTile + 2; ++i) m[i] = hn::Load(d, at + 4 * i * kStrip);
        TransformOutput(m, x);
#pragma GCC unroll 4
        for (int i = 0; i < kTile; ++i)
          hn::Store(Activate(hn::Add(x[i], bias), negative_slope), d, at + 4 * i * kStrip);
      }
  }
}

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
