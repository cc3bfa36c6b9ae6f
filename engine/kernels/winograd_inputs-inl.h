// The input side of a Winograd convolution: tiles of a plane, transformed along all axes. Included
// once per target.
#include <hwy/highway.h>

#include <cstdint>
#include <span>

#include "engine/kernels/channels-inl.h"
#include "engine/kernels/planes.h"
#include "engine/kernels/vector-inl.h"
#include "engine/kernels/winograd_transforms-inl.h"

#ifndef SOLIDTEX_WINOGRAD_INPUTS_ONCE
#define SOLIDTEX_WINOGRAD_INPUTS_ONCE
namespace solidtex::engine {

// From one input to the next among transformed inputs, [input][ix][iy][iz][tile]: the places of an
// input's stores are constants, and the padding spreads one position of all inputs over the sets of
// the first cache.
template <int kTile>
inline constexpr std::ptrdiff_t kInputPitch = ((kTile + 2) * 16 + 4) * kStrip;

// Places of a tile's values while its products become voxels, [x position][y][z]; in the end the
// first ones are the voxels.
template <int kTile>
inline constexpr std::ptrdiff_t kSlots = kTile == 1 ? 4 : (kTile + 2) * 4;

// Floats of scratch memory for a strip.
struct ScratchSizes {
  explicit ScratchSizes(const ConvChain& chain) {
    const int tile = chain.tile(), width = widest_layer(chain);
    inputs = (tile == 2 ? kInputPitch<2> : kInputPitch<4>)*chain.first.inputs;
    products = 8 * chain.first.outputs * kStrip;
    slots = (tile == 1 ? kSlots<1> : tile == 2 ? kSlots<2> : kSlots<4>)*width * kStrip;
    layer = width * kStrip;
    results = chain.rest.empty() ? 0 : 4 * tile * width * kStrip;
  }
  std::ptrdiff_t inputs, products, slots, layer, results;
};

}  // namespace solidtex::engine
#endif

#if defined(SOLIDTEX_WINOGRAD_INPUTS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SOLIDTEX_WINOGRAD_INPUTS_INL_H
#undef SOLIDTEX_WINOGRAD_INPUTS_INL_H
#else
#define SOLIDTEX_WINOGRAD_INPUTS_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

// Position kZ of F(2, 3) along z: d0 is the odd one of the tile before, d1 and d2 its own two, d3
// the even one of the tile after.
template <int kZ>
HWY_INLINE Floats AlongZ(const float* even, const float* odd) {
  const Float d;
  if constexpr (kZ == 0) return hn::Sub(hn::LoadU(d, odd - 1), hn::LoadU(d, odd));
  if constexpr (kZ == 1) return hn::Add(hn::LoadU(d, even), hn::LoadU(d, odd));
  if constexpr (kZ == 2) return hn::Sub(hn::LoadU(d, odd), hn::LoadU(d, even));
  if constexpr (kZ == 3) return hn::Sub(hn::LoadU(d, even), hn::LoadU(d, even + 1));
}

// A vector of tiles that are neighbours in memory, of which the first `count` are wanted. It may go
// on from one row to the next.
struct TileVector {
  std::int64_t x, y, z;  // of the first tile
  std::ptrdiff_t count;
};

// The planes that tiles of kTile x 2 x 2 voxels read, at a vector of them.
template <int kTile>
struct TilePlanes {
  TilePlanes() = default;
  TilePlanes(const ConstPlanes& source, const TileVector& at)
      : row(source.row_pitch), phase(source.phase_pitch) {
    for (int i = 0; i < kTile + 2; ++i)
      x[i] = source.plane(kTile * at.x - 1 + i) + source.offset(at.y, at.z);
  }

  // Along y: the odd one of the tile before, its own two, the even one of the tile after.
  HWY_INLINE const float* At(int plane, int y) const {
    const std::ptrdiff_t offset = y == 0 ? 2 * phase - row : y == 2 ? 2 * phase : y == 3 ? row : 0;
    return x[plane] + offset;
  }

  const float* x[kTile + 2];
  std::ptrdiff_t row, phase;  // pitches
};

// The positions (ix, iy, kZ) of a vector of tiles.
template <int kTile, int kZ>
HWY_INLINE void InputPositions(const TilePlanes<kTile>& planes, float* HWY_RESTRICT out) {
  Floats v[kTile + 2][4];
#pragma GCC unroll 6
  for (int x = 0; x < kTile + 2; ++x) {
#pragma GCC unroll 4
    for (int y = 0; y < 4; ++y) {
      const float* even = planes.At(x, y);
      v[x][y] = AlongZ<kZ>(even, even + planes.phase);
    }
    TransformInput(v[x]);
  }
#pragma GCC unroll 4
  for (int y = 0; y < 4; ++y) {
    Floats along_x[kTile + 2];
#pragma GCC unroll 6
    for (int x = 0; x < kTile + 2; ++x) along_x[x] = v[x][y];
    TransformInput(along_x);
#pragma GCC unroll 6
    for (int x = 0; x < kTile + 2; ++x)
      hn::Store(along_x[x], Float(), out + (16 * x + 4 * y + kZ) * kStrip);
  }
}

// All positions of some vectors of tiles, for all channels of a source.
template <int kTile>
void TransformTiles(const ConstPlanes& source, std::span<const TileVector> vectors,
                    float* HWY_RESTRICT out) {
  TilePlanes<kTile> tiles[kStrip / hn::MaxLanes(Float())];
  for (std::size_t i = 0; i < vectors.size(); ++i) tiles[i] = {source, vectors[i]};
  // Vectors inside: they often share cache lines.
  for (int c = 0; c < source.channels; ++c, out += kInputPitch<kTile>)
    for (std::size_t i = 0; i < vectors.size(); ++i) {
      float* to = out + i * hn::MaxLanes(Float());
      InputPositions<kTile, 0>(tiles[i], to);
      InputPositions<kTile, 1>(tiles[i], to);
      InputPositions<kTile, 2>(tiles[i], to);
      InputPositions<kTile, 3>(tiles[i], to);
      for (const float*& plane : tiles[i].x) plane += source.channel_pitch();
    }
}

// B^T d where d1 = d2, without the position 2 that is zero.
HWY_INLINE void TransformUpsampled(Floats& low, Floats& middle, Floats& high) {
  low = hn::Sub(low, middle), high = hn::Sub(middle, high), middle = hn::Add(middle, middle);
}

template <int kZ>
HWY_INLINE void UpsampledPositions(const float* const (&planes)[3], std::ptrdiff_t row,
                                   float* HWY_RESTRICT out) {
  const Float d;
  Floats v[3][3];
#pragma GCC unroll 3
  for (int y = 0; y < 3; ++y)
#pragma GCC unroll 3
    for (int x = 0; x < 3; ++x) {
      const float* at = planes[x] + (y - 1) * row;
      const Floats own = hn::LoadU(d, at);
      if constexpr (kZ == 0) v[x][y] = hn::Sub(hn::LoadU(d, at - 1), own);
      if constexpr (kZ == 1) v[x][y] = hn::Add(own, own);
      if constexpr (kZ == 3) v[x][y] = hn::Sub(own, hn::LoadU(d, at + 1));
    }
#pragma GCC unroll 3
  for (int x = 0; x < 3; ++x) TransformUpsampled(v[x][0], v[x][1], v[x][2]);
  constexpr int kPosition[3] = {0, 1, 3};
#pragma GCC unroll 3
  for (int y = 0; y < 3; ++y) {
    TransformUpsampled(v[0][y], v[1][y], v[2][y]);
#pragma GCC unroll 3
    for (int x = 0; x < 3; ++x)
      hn::Store(v[x][y], d, out + (16 * kPosition[x] + 4 * kPosition[y] + kZ) * kStrip);
  }
}

// The same of an upsampled source: position 2 of every axis is zero and left out.
void TransformUpsampledTiles(const ConstPlanes& source, std::span<const TileVector> vectors,
                             float* HWY_RESTRICT out) {
  for (int c = 0; c < source.channels; ++c, out += kInputPitch<2>)
    for (std::size_t i = 0; i < vectors.size(); ++i) {
      const std::ptrdiff_t at =
          c * source.channel_pitch() + source.offset(vectors[i].y, vectors[i].z);
      const float* planes[3];
      for (int x = 0; x < 3; ++x) planes[x] = source.plane(vectors[i].x - 1 + x) + at;
      float* to = out + i * hn::MaxLanes(Float());
      UpsampledPositions<0>(planes, source.row_pitch, to);
      UpsampledPositions<1>(planes, source.row_pitch, to);
      UpsampledPositions<3>(planes, source.row_pitch, to);
    }
}

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
