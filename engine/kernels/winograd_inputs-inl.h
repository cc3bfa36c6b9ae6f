// The input side of a Winograd convolution: tiles of a plane, transformed along all axes. Included
// once per target.
#include <hwy/highway.h>

#include <cstdint>
#include <span>

#include "engine/kernels/channels-inl.h"
#include "engine/kernels/planes.h"
#include "engine/kernels/vector-inl.h"

#ifndef SOLIDTEX_WINOGRAD_INPUTS_ONCE
#define SOLIDTEX_WINOGRAD_INPUTS_ONCE
namespace solidtex::engine {

inline constexpr int kGroups = 16;
inline constexpr std::ptrdiff_t kGroupPad = 16;

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

// B^T d of F(2, 3): (d0 - d2, d1 + d2, d2 - d1, d1 - d3).
HWY_INLINE void TransformInput(Floats& d0, Floats& d1, Floats& d2, Floats& d3) {
  const Floats v0 = hn::Sub(d0, d2), v1 = hn::Add(d1, d2), v2 = hn::Sub(d2, d1),
               v3 = hn::Sub(d1, d3);
  d0 = v0, d1 = v1, d2 = v2, d3 = v3;
}

// Transformed inputs, [group = (ix, iy)][input][iz][tile]. Groups are padded by a line, or stores
// to all of them would fall into few sets of the first cache.
constexpr std::ptrdiff_t GroupPitch(int inputs) { return 4 * kStrip * inputs + kGroupPad; }

// Position kZ of the transform along z: d0 is the odd one of the tile before, d1 and d2 its own
// two, d3 the even one of the tile after.
template <int kZ>
HWY_INLINE Floats AlongZ(const float* even, const float* odd) {
  const Float d;
  if constexpr (kZ == 0) return hn::Sub(hn::LoadU(d, odd - 1), hn::LoadU(d, odd));
  if constexpr (kZ == 1) return hn::Add(hn::LoadU(d, even), hn::LoadU(d, odd));
  if constexpr (kZ == 2) return hn::Sub(hn::LoadU(d, odd), hn::LoadU(d, even));
  if constexpr (kZ == 3) return hn::Sub(hn::LoadU(d, even), hn::LoadU(d, even + 1));
}

// The four planes that a tile reads, at a vector of tiles of one channel.
struct TilePlanes {
  const float* x[4];
  std::ptrdiff_t row, phase;  // pitches

  // Along y: the odd one of the tile before, its own two, the even one of the tile after.
  HWY_INLINE const float* At(int plane, int y) const {
    const std::ptrdiff_t offset = y == 0 ? 2 * phase - row : y == 2 ? 2 * phase : y == 3 ? row : 0;
    return x[plane] + offset;
  }
};

// The 16 positions (ix, iy, kZ) of a vector of tiles.
template <int kZ>
HWY_INLINE void InputPositions(const TilePlanes& planes, std::ptrdiff_t pitch,
                               float* HWY_RESTRICT out) {
  Floats v[4][4];
#pragma GCC unroll 4
  for (int y = 0; y < 4; ++y)
#pragma GCC unroll 4
    for (int x = 0; x < 4; ++x) {
      const float* even = planes.At(x, y);
      v[x][y] = AlongZ<kZ>(even, even + planes.phase);
    }
#pragma GCC unroll 4
  for (int y = 0; y < 4; ++y) TransformInput(v[0][y], v[1][y], v[2][y], v[3][y]);
#pragma GCC unroll 4
  for (int x = 0; x < 4; ++x) {
    TransformInput(v[x][0], v[x][1], v[x][2], v[x][3]);
#pragma GCC unroll 4
    for (int y = 0; y < 4; ++y)
      hn::Store(v[x][y], Float(), out + (4 * x + y) * pitch + kZ * kStrip);
  }
}

// A vector of tiles that are neighbours in memory, of which the first `count` are wanted. It may go
// on from one row to the next.
struct TileVector {
  std::int64_t x, y, z;  // of the first tile
  std::ptrdiff_t count;
};

// All positions of some vectors of tiles, for all channels of a source. `out` is the place of the
// first position.
void TransformTiles(const ConstPlanes& source, std::span<const TileVector> vectors,
                    std::ptrdiff_t pitch, float* HWY_RESTRICT out) {
  TilePlanes tiles[kStrip / hn::MaxLanes(Float())];
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    tiles[i].row = source.row_pitch;
    tiles[i].phase = source.phase_pitch;
    for (int x = 0; x < 4; ++x)
      tiles[i].x[x] =
          source.plane(2 * vectors[i].x - 1 + x) + source.offset(vectors[i].y, vectors[i].z);
  }
  // Vectors inside: they often share cache lines.
  for (int c = 0; c < source.channels; ++c, out += 4 * kStrip)
    for (std::size_t i = 0; i < vectors.size(); ++i) {
      float* to = out + i * hn::MaxLanes(Float());
      InputPositions<0>(tiles[i], pitch, to);
      InputPositions<1>(tiles[i], pitch, to);
      InputPositions<2>(tiles[i], pitch, to);
      InputPositions<3>(tiles[i], pitch, to);
      for (const float*& plane : tiles[i].x) plane += source.channel_pitch();
    }
}

// B^T d where d1 = d2, without the position 2 that is zero.
HWY_INLINE void TransformUpsampled(Floats& low, Floats& middle, Floats& high) {
  low = hn::Sub(low, middle), high = hn::Sub(middle, high), middle = hn::Add(middle, middle);
}

template <int kZ>
HWY_INLINE void UpsampledPositions(const float* const (&planes)[3], std::ptrdiff_t row,
                                   std::ptrdiff_t pitch, float* HWY_RESTRICT out) {
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
  for (int y = 0; y < 3; ++y) TransformUpsampled(v[0][y], v[1][y], v[2][y]);
  constexpr int kPosition[3] = {0, 1, 3};
#pragma GCC unroll 3
  for (int x = 0; x < 3; ++x) {
    TransformUpsampled(v[x][0], v[x][1], v[x][2]);
#pragma GCC unroll 3
    for (int y = 0; y < 3; ++y)
      hn::Store(v[x][y], d, out + (4 * kPosition[x] + kPosition[y]) * pitch + kZ * kStrip);
  }
}

// The same of an upsampled source: position 2 of every axis is zero and left out.
void TransformUpsampledTiles(const ConstPlanes& source, std::span<const TileVector> vectors,
                             std::ptrdiff_t pitch, float* HWY_RESTRICT out) {
  for (int c = 0; c < source.channels; ++c, out += 4 * kStrip)
    for (std::size_t i = 0; i < vectors.size(); ++i) {
      const std::ptrdiff_t at =
          c * source.channel_pitch() + source.offset(vectors[i].y, vectors[i].z);
      const float* planes[3];
      for (int x = 0; x < 3; ++x) planes[x] = source.plane(vectors[i].x - 1 + x) + at;
      float* to = out + i * hn::MaxLanes(Float());
      UpsampledPositions<0>(planes, source.row_pitch, pitch, to);
      UpsampledPositions<1>(planes, source.row_pitch, pitch, to);
      UpsampledPositions<3>(planes, source.row_pitch, pitch, to);
    }
}

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
