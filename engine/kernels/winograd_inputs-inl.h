// Input side of a Winograd convolution: tiles of planes, transformed along all axes. Included once
// per target.
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

// Distance between transformed inputs, [input][ix][iy][iz][tile]. It is a constant, so stores have
// constant offsets; the padding spreads one position of all inputs over the sets of the first-level
// cache.
template <int kTile>
inline constexpr std::ptrdiff_t kInputPitch = ((kTile + 2) * 16 + 4) * kStrip;

// Slots of a tile's values while products become voxels, [x position][y][z]. The first ones become
// the voxels.
template <int kTile>
inline constexpr std::ptrdiff_t kSlots = kTile == 1 ? 4 : (kTile + 2) * 4;

// Floats of scratch memory for a strip.
struct ScratchSizes {
  explicit ScratchSizes(const ConvChain& chain) {
    const int tile = chain.tile(), width = widest_layer(chain);
    inputs = (tile == 2 ? kInputPitch<2> : kInputPitch<4>)*chain.first.inputs();
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

// Tiles that are contiguous in memory, possibly across rows: lanes of a vector.
struct TileRun {
  std::int64_t x, y, z;  // of the first tile
  std::ptrdiff_t lane, count;
};

// A vector of tiles: one run in large regions, several joined ones in small regions.
struct TileVector {
  static constexpr int kMaxRuns = 4;

  const TileRun& first() const { return runs[0]; }
  const TileRun& last() const { return runs[size - 1]; }
  std::ptrdiff_t used() const { return size == 0 ? 0 : last().lane + last().count; }

  TileRun runs[kMaxRuns];
  int size = 0;
};

// The kPlanes planes that a vector of tiles reads, from x = `first` + kStep for each tile on.
template <int kStep, int kPlanes, bool kJoined>
class TilePlanes {
 public:
  TilePlanes() = default;
  // origin: that of the tiles along y and z.
  TilePlanes(const ConstPlanes& source, const TileVector& vector, std::int64_t first, int origin)
      : size_(vector.size) {
    for (int r = 0; r < (kJoined ? size_ : 1); ++r) {
      const TileRun& run = vector.runs[r];
      if constexpr (kJoined)
        lanes_[r] = hn::Not(hn::FirstN(Float(), static_cast<std::size_t>(run.lane)));
      for (int i = 0; i < kPlanes; ++i)
        at_[i][r] =
            source.plane(kStep * run.x + first + i) + source.offset(run.y, run.z) - run.lane;
    }
    // Inputs of a tile on an axis: the voxel before it, its own two, and the voxel after it.
    for (int i = 0; i < 4; ++i) {
      const int voxel = i - 1 + origin;
      const std::ptrdiff_t tile = voxel >> 1, odd = voxel & 1;
      y_[i] = tile * source.row_pitch + odd * 2 * source.parity_pitch;
      z_[i] = tile + odd * source.parity_pitch;
    }
  }

  void AddChannel(std::ptrdiff_t pitch) {
    for (auto& plane : at_)
      for (int r = 0; r < (kJoined ? size_ : 1); ++r) plane[r] += pitch;
  }

  HWY_INLINE std::ptrdiff_t Y(int y) const { return y_[y]; }
  HWY_INLINE std::ptrdiff_t Z(int z) const { return z_[z]; }

  HWY_INLINE Floats Load(int plane, std::ptrdiff_t offset) const {
    const Float d;
    Floats v = hn::LoadU(d, at_[plane][0] + offset);
    if constexpr (kJoined)
      for (int r = 1; r < size_; ++r)
        v = hn::IfThenElse(lanes_[r], hn::LoadU(d, at_[plane][r] + offset), v);
    return v;
  }

 private:
  static constexpr int kRuns = kJoined ? TileVector::kMaxRuns : 1;

  const float* at_[kPlanes][kRuns];
  hn::Mask<Float> lanes_[kRuns];  // from the first lane of each run on
  int size_ = 0;
  std::ptrdiff_t y_[4], z_[4];
};

// Returns position kZ of F(2, 3) along z.
template <int kZ, class Planes>
HWY_INLINE Floats AlongZ(const Planes& planes, int x, std::ptrdiff_t at) {
  const auto d = [&](int z) { return planes.Load(x, at + planes.Z(z)); };
  if constexpr (kZ == 0) return hn::Sub(d(0), d(2));
  if constexpr (kZ == 1) return hn::Add(d(1), d(2));
  if constexpr (kZ == 2) return hn::Sub(d(2), d(1));
  if constexpr (kZ == 3) return hn::Sub(d(1), d(3));
}

// Computes the positions (ix, iy, kZ) of a vector of tiles.
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

// Computes all positions of some vectors of tiles for all channels of a source.
template <int kTile, bool kJoined>
void TransformTiles(const ConstPlanes& source, std::span<const TileVector> vectors, int origin,
                    float* HWY_RESTRICT out) {
  TilePlanes<kTile, kTile + 2, kJoined> tiles[kStrip / hn::MaxLanes(Float())];
  for (std::size_t i = 0; i < vectors.size(); ++i)
    tiles[i] = {source, vectors[i], origin - 1, origin};
  // Vectors in the inner loop: they often share cache lines.
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

// Turns a and b into a - b and a + b, positions 0 and 1. Position 3 equals position 0.
HWY_INLINE void TransformUpsampled(Floats& a, Floats& b) {
  const Floats difference = hn::Sub(a, b);
  b = hn::Add(a, b), a = difference;
}

// Computes positions 0 and 1 on every axis of an upsampled source.
template <class Planes>
HWY_INLINE void UpsampledPositions(const Planes& planes, std::ptrdiff_t row,
                                   float* HWY_RESTRICT out) {
  Floats v[2][2][2];
#pragma GCC unroll 2
  for (int x = 0; x < 2; ++x) {
#pragma GCC unroll 2
    for (int y = 0; y < 2; ++y) {
      v[x][y][0] = planes.Load(x, y * row), v[x][y][1] = planes.Load(x, y * row + 1);
      TransformUpsampled(v[x][y][0], v[x][y][1]);
    }
#pragma GCC unroll 2
    for (int z = 0; z < 2; ++z) TransformUpsampled(v[x][0][z], v[x][1][z]);
  }
#pragma GCC unroll 2
  for (int y = 0; y < 2; ++y)
#pragma GCC unroll 2
    for (int z = 0; z < 2; ++z) {
      TransformUpsampled(v[0][y][z], v[1][y][z]);
      hn::Store(v[0][y][z], Float(), out + (4 * y + z) * kStrip);
      hn::Store(v[1][y][z], Float(), out + (16 + 4 * y + z) * kStrip);
    }
}

// As TransformTiles, for an upsampled source.
template <bool kJoined>
void TransformUpsampledTiles(const ConstPlanes& source, std::span<const TileVector> vectors,
                             float* HWY_RESTRICT out) {
  TilePlanes<1, 2, kJoined> tiles[kStrip / hn::MaxLanes(Float())];
  for (std::size_t i = 0; i < vectors.size(); ++i) tiles[i] = {source, vectors[i], 0, 0};
  for (int c = 0; c < source.channels; ++c, out += kInputPitch<2>)
    for (std::size_t i = 0; i < vectors.size(); ++i) {
      UpsampledPositions(tiles[i], source.row_pitch, out + i * hn::MaxLanes(Float()));
      tiles[i].AddChannel(source.channel_pitch());
    }
}

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
