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

// Tiles that are neighbours in memory, from one row to the next perhaps: lanes of a vector.
struct TileRun {
  std::int64_t x, y, z;  // of the first tile
  std::ptrdiff_t lane, count;
};

// A vector of tiles. One run fills it in large regions; in small ones it joins several.
struct TileVector {
  static constexpr int kMostRuns = 4;

  const TileRun& first() const { return runs[0]; }
  const TileRun& last() const { return runs[size - 1]; }
  std::ptrdiff_t used() const { return size == 0 ? 0 : last().lane + last().count; }

  TileRun runs[kMostRuns];
  int size = 0;
};

// The kPlanes planes that tiles of kTile x 2 x 2 voxels read, at a vector of them.
template <int kTile, int kPlanes, bool kJoined>
class TilePlanes {
 public:
  TilePlanes() = default;
  TilePlanes(const ConstPlanes& source, const TileVector& vector)
      : size_(vector.size), row_(source.row_pitch), phase_(source.phase_pitch) {
    for (int r = 0; r < (kJoined ? size_ : 1); ++r) {
      const TileRun& run = vector.runs[r];
      if constexpr (kJoined)
        lanes_[r] = hn::Not(hn::FirstN(Float(), static_cast<std::size_t>(run.lane)));
      for (int i = 0; i < kPlanes; ++i)
        at_[i][r] = source.plane(kTile * run.x - 1 + i) + source.offset(run.y, run.z) - run.lane;
    }
  }

  void AddChannel(std::ptrdiff_t pitch) {
    for (auto& plane : at_)
      for (int r = 0; r < (kJoined ? size_ : 1); ++r) plane[r] += pitch;
  }

  // Along y: the odd one of the tile before, its own two, the even one of the tile after.
  HWY_INLINE std::ptrdiff_t Y(int y) const {
    return y == 0 ? 2 * phase_ - row_ : y == 2 ? 2 * phase_ : y == 3 ? row_ : 0;
  }
  HWY_INLINE std::ptrdiff_t row() const { return row_; }
  HWY_INLINE std::ptrdiff_t phase() const { return phase_; }

  HWY_INLINE Floats Load(int plane, std::ptrdiff_t offset) const {
    const Float d;
    Floats v = hn::LoadU(d, at_[plane][0] + offset);
    if constexpr (kJoined)
      for (int r = 1; r < size_; ++r)
        v = hn::IfThenElse(lanes_[r], hn::LoadU(d, at_[plane][r] + offset), v);
    return v;
  }

 private:
  static constexpr int kRuns = kJoined ? TileVector::kMostRuns : 1;

  const float* at_[kPlanes][kRuns];
  hn::Mask<Float> lanes_[kRuns];  // from the first of each run on
  int size_ = 0;
  std::ptrdiff_t row_ = 0, phase_ = 0;  // pitches
};

// Position kZ of F(2, 3) along z, from the even ones on at `even`: d0 is the odd one of the tile
// before, d1 and d2 its own two, d3 the even one of the tile after.
template <int kZ, class Planes>
HWY_INLINE Floats AlongZ(const Planes& planes, int x, std::ptrdiff_t even) {
  const std::ptrdiff_t odd = even + planes.phase();
  if constexpr (kZ == 0) return hn::Sub(planes.Load(x, odd - 1), planes.Load(x, odd));
  if constexpr (kZ == 1) return hn::Add(planes.Load(x, even), planes.Load(x, odd));
  if constexpr (kZ == 2) return hn::Sub(planes.Load(x, odd), planes.Load(x, even));
  if constexpr (kZ == 3) return hn::Sub(planes.Load(x, even), planes.Load(x, even + 1));
}

// The positions (ix, iy, kZ) of a vector of tiles.
template <int kTile, int kZ, class Planes>
HWY_INLINE void InputPositions(const Planes& planes, float* HWY_RESTRICT out) {
  Floats v[kTile + 2][4];
#pragma GCC unroll 6
  for (int x = 0; x < kTile + 2; ++x) {
#pragma GCC unroll 4
    for (int y = 0; y < 4; ++y) v[x][y] = AlongZ<kZ>(planes, x, planes.Y(y));
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
template <int kTile, bool kJoined>
void TransformTiles(const ConstPlanes& source, std::span<const TileVector> vectors,
                    float* HWY_RESTRICT out) {
  TilePlanes<kTile, kTile + 2, kJoined> tiles[kStrip / hn::MaxLanes(Float())];
  for (std::size_t i = 0; i < vectors.size(); ++i) tiles[i] = {source, vectors[i]};
  // Vectors inside: they often share cache lines.
  for (int c = 0; c < source.channels; ++c, out += kInputPitch<kTile>)
    for (std::size_t i = 0; i < vectors.size(); ++i) {
      float* to = out + i * hn::MaxLanes(Float());
      InputPositions<kTile, 0>(tiles[i], to);
      InputPositions<kTile, 1>(tiles[i], to);
      InputPositions<kTile, 2>(tiles[i], to);
      InputPositions<kTile, 3>(tiles[i], to);
      tiles[i].AddChannel(source.channel_pitch());
    }
}

// B^T d where d1 = d2, without the position 2 that is zero.
HWY_INLINE void TransformUpsampled(Floats& low, Floats& middle, Floats& high) {
  low = hn::Sub(low, middle), high = hn::Sub(middle, high), middle = hn::Add(middle, middle);
}

template <int kZ, class Planes>
HWY_INLINE void UpsampledPositions(const Planes& planes, float* HWY_RESTRICT out) {
  const Float d;
  Floats v[3][3];
#pragma GCC unroll 3
  for (int y = 0; y < 3; ++y)
#pragma GCC unroll 3
    for (int x = 0; x < 3; ++x) {
      const std::ptrdiff_t at = (y - 1) * planes.row();
      const Floats own = planes.Load(x, at);
      if constexpr (kZ == 0) v[x][y] = hn::Sub(planes.Load(x, at - 1), own);
      if constexpr (kZ == 1) v[x][y] = hn::Add(own, own);
      if constexpr (kZ == 3) v[x][y] = hn::Sub(own, planes.Load(x, at + 1));
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
template <bool kJoined>
void TransformUpsampledTiles(const ConstPlanes& source, std::span<const TileVector> vectors,
                             float* HWY_RESTRICT out) {
  TilePlanes<1, 3, kJoined> tiles[kStrip / hn::MaxLanes(Float())];
  for (std::size_t i = 0; i < vectors.size(); ++i) tiles[i] = {source, vectors[i]};
  for (int c = 0; c < source.channels; ++c, out += kInputPitch<2>)
    for (std::size_t i = 0; i < vectors.size(); ++i) {
      float* to = out + i * hn::MaxLanes(Float());
      UpsampledPositions<0>(tiles[i], to);
      UpsampledPositions<1>(tiles[i], to);
      UpsampledPositions<3>(tiles[i], to);
      tiles[i].AddChannel(source.channel_pitch());
    }
}

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
