// Winograd convolutions on the machine's best target. See winograd.h.
#include "engine/kernels/winograd.h"

#include "engine/kernels/targets.h"
// foreach_target.h includes this file once per target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/kernels/winograd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "engine/kernels/channels-inl.h"
#include "engine/kernels/vector-inl.h"

#ifndef SOLIDTEX_WINOGRAD_ONCE
#define SOLIDTEX_WINOGRAD_ONCE
namespace solidtex::engine {

inline constexpr int kGroups = 16;
inline constexpr std::ptrdiff_t kGroupPad = 16;

}  // namespace solidtex::engine
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

// A^T m of F(2, 3): (m0 + m1 + m2, m1 - m2 - m3).
HWY_INLINE void TransformOutput(Floats m0, Floats m1, Floats m2, Floats m3, Floats& even,
                                Floats& odd) {
  even = hn::Add(hn::Add(m0, m1), m2);
  odd = hn::Sub(hn::Sub(m1, m2), m3);
}

// Some of the input channels of four products (ix, iy, 0 .. 3).
struct ProductTerms {
  const float* weights;  // [input][output][iz]
  const float* values;   // [input][iz][tile]
  int count;
  bool upsampled;  // nothing at iz = 2
};

#if HWY_NATIVE_FMA

// Four products of three outputs for some vectors of tiles: 24 sums of 32 registers, or 12 of 16.
inline constexpr int kProductOutputs = 3;
inline constexpr int kProductVectors = HWY_TARGET == HWY_AVX2 ? 1 : 2;

// GCC 12 would load a value again for each of its uses, as an operand in memory: with three uses
// the loads, not the multiplications, then set the pace (75 instead of 55 ns a voxel).
HWY_INLINE Floats InRegister(Floats v) {
#if HWY_COMPILER_GCC && HWY_ARCH_X86
  __asm__("" : "+v"(v.raw));
#endif
  return v;
}

template <int kOutputs, int kVectors>
using ProductSums = Floats[kOutputs][4][kVectors];

template <int kOutputs, int kVectors, bool kUpsampled>
HWY_INLINE void Accumulate(const ProductTerms& terms, int outputs, int first, std::ptrdiff_t at,
                           ProductSums<kOutputs, kVectors>& sum) {
  const Float d;
  const float* HWY_RESTRICT weights = terms.weights + 4 * first;
  const float* HWY_RESTRICT values = terms.values + at;
  for (int i = 0; i < terms.count; ++i, weights += 4 * outputs, values += 4 * kStrip) {
#pragma GCC unroll 4
    for (int z = 0; z < 4; ++z) {
      if (kUpsampled && z == 2) continue;
      Floats x[kVectors];
#pragma GCC unroll 2
      for (int v = 0; v < kVectors; ++v)
        x[v] = InRegister(hn::Load(d, values + z * kStrip + v * hn::MaxLanes(d)));
#pragma GCC unroll 3
      for (int o = 0; o < kOutputs; ++o) {
        const Floats w = hn::Set(d, weights[4 * o + z]);
#pragma GCC unroll 2
        for (int v = 0; v < kVectors; ++v) sum[o][z][v] = hn::MulAdd(w, x[v], sum[o][z][v]);
      }
    }
  }
}

template <int kOutputs, int kVectors>
HWY_INLINE void ProductTile(std::span<const ProductTerms> terms, int outputs, int first,
                            std::ptrdiff_t at, float* HWY_RESTRICT out) {
  const Float d;
  ProductSums<kOutputs, kVectors> sum;
#pragma GCC unroll 3
  for (int o = 0; o < kOutputs; ++o)
#pragma GCC unroll 4
    for (int z = 0; z < 4; ++z)
#pragma GCC unroll 2
      for (int v = 0; v < kVectors; ++v) sum[o][z][v] = hn::Zero(d);
  for (const ProductTerms& part : terms) {
    if (part.upsampled)
      Accumulate<kOutputs, kVectors, true>(part, outputs, first, at, sum);
    else
      Accumulate<kOutputs, kVectors, false>(part, outputs, first, at, sum);
  }
  out += first * 8 * kStrip + at;
#pragma GCC unroll 3
  for (int o = 0; o < kOutputs; ++o, out += 8 * kStrip)
#pragma GCC unroll 2
    for (int v = 0; v < kVectors; ++v) {
      Floats even, odd;
      TransformOutput(sum[o][0][v], sum[o][1][v], sum[o][2][v], sum[o][3][v], even, odd);
      hn::Store(even, d, out + v * hn::MaxLanes(d));
      hn::Store(odd, d, out + kStrip + v * hn::MaxLanes(d));
    }
}

template <int kVectors>
void ProductTiles(std::span<const ProductTerms> terms, int outputs, std::ptrdiff_t at,
                  float* HWY_RESTRICT out) {
  int first = 0;
  for (; first + kProductOutputs <= outputs; first += kProductOutputs)
    ProductTile<kProductOutputs, kVectors>(terms, outputs, first, at, out);
  if (first + 2 == outputs) ProductTile<2, kVectors>(terms, outputs, first, at, out);
  if (first + 1 == outputs) ProductTile<1, kVectors>(terms, outputs, first, at, out);
}

// The products (ix, iy, 0 .. 3) of `count` tiles, summed over the terms and transformed along z;
// output o's two go to out[8 o * kStrip] and out[(8 o + 1) * kStrip].
void Products(std::span<const ProductTerms> terms, int outputs, std::ptrdiff_t count, float* out) {
  const std::ptrdiff_t lanes = FloatLanes();
  std::ptrdiff_t at = 0;
  for (; at + (kProductVectors - 1) * lanes < count; at += kProductVectors * lanes)
    ProductTiles<kProductVectors>(terms, outputs, at, out);
  if (at < count) ProductTiles<1>(terms, outputs, at, out);
}

#else

// Without fused multiply-add in the instruction set, the same sums one by one.
void Products(std::span<const ProductTerms> terms, int outputs, std::ptrdiff_t count, float* out) {
  for (int o = 0; o < outputs; ++o)
    for (std::ptrdiff_t t = 0; t < count; ++t) {
      float sum[4] = {};
      for (const ProductTerms& part : terms)
        for (int i = 0; i < part.count; ++i)
          for (int z = 0; z < 4; ++z)
            if (!part.upsampled || z != 2)
              sum[z] = std::fma(part.weights[(i * outputs + o) * 4 + z],
                                part.values[(4 * i + z) * kStrip + t], sum[z]);
      out[8 * o * kStrip + t] = (sum[0] + sum[1]) + sum[2];
      out[(8 * o + 1) * kStrip + t] = (sum[1] - sum[2]) - sum[3];
    }
}

#endif

// Adds position kX to the eight voxels (px, py, pz) of a tile, for all outputs; the last ones are
// finished with bias and activation. Position (iy, pz) of output o is
// products[(8 o + 2 iy + pz) * kStrip], voxel p is out[(8 o + p) * kStrip].
template <int kX>
void OutputSlice(const WinogradLayer& layer, std::ptrdiff_t count,
                 const float* HWY_RESTRICT products, float* HWY_RESTRICT out) {
  const Float d;
  constexpr std::ptrdiff_t kLanes = hn::MaxLanes(d);
  const Floats slope = hn::Set(d, layer.slope);
  for (int o = 0; o < layer.outputs; ++o, products += 8 * kStrip, out += 8 * kStrip) {
    const Floats bias = hn::Set(d, layer.bias[o]);
    for (std::ptrdiff_t t = 0; t < count; t += kLanes) {
#pragma GCC unroll 2
      for (int z = 0; z < 2; ++z) {
        const auto m = [&](int y) { return hn::Load(d, products + (2 * y + z) * kStrip + t); };
        Floats sums[2];
        TransformOutput(m(0), m(1), m(2), m(3), sums[0], sums[1]);
#pragma GCC unroll 2
        for (int y = 0; y < 2; ++y) {
          float* even = out + (2 * y + z) * kStrip + t;
          float* odd = even + 4 * kStrip;
          const Floats s = sums[y];
          if constexpr (kX == 0) hn::Store(s, d, even);
          if constexpr (kX == 1) {
            hn::Store(hn::Add(hn::Load(d, even), s), d, even);
            hn::Store(s, d, odd);
          }
          if constexpr (kX == 2) {
            hn::Store(Activate(hn::Add(hn::Add(hn::Load(d, even), s), bias), slope), d, even);
            hn::Store(hn::Sub(hn::Load(d, odd), s), d, odd);
          }
          if constexpr (kX == 3)
            hn::Store(Activate(hn::Add(hn::Sub(hn::Load(d, odd), s), bias), slope), d, odd);
        }
      }
    }
  }
}

// One call's work, in strips of at most kStrip tiles.
class Convolution {
 public:
  Convolution(const ConvChain& chain, std::span<const ConvSource> sources, const TileRange& range,
              const Planes& out, float* scratch)
      : chain_(chain), sources_(sources), range_(range), out_(out) {
    inputs_ = scratch;
    products_ = inputs_ + kGroups * GroupPitch(chain.first.inputs);
    current_ = products_ + 8 * kStrip * static_cast<std::ptrdiff_t>(chain.first.outputs);
    next_ = current_ + 8 * kStrip * static_cast<std::ptrdiff_t>(widest_layer(chain));
    FindTerms();
  }

  // Vectors either keep to their rows or go on from one to the next, whichever takes fewer of them;
  // the second needs one row pitch for all sources, and also computes what lies between the rows.
  void Run() {
    const std::ptrdiff_t width = range_.z_hi - range_.z_lo, rows = range_.y_hi - range_.y_lo;
    const std::ptrdiff_t pitch = sources_[0].planes.row_pitch, lanes = FloatLanes();
    bool same_pitch = true;
    for (const ConvSource& source : sources_) same_pitch &= source.planes.row_pitch == pitch;
    const std::ptrdiff_t run = (rows - 1) * pitch + width;
    const auto vectors = [lanes](std::ptrdiff_t count) { return (count + lanes - 1) / lanes; };
    if (same_pitch && vectors(run) < rows * vectors(width)) {
      wrap_ = pitch;
      for (std::int64_t x = range_.x_lo >> 1; 2 * x < range_.x_hi; ++x) AddRun(x, range_.y_lo, run);
    } else {
      wrap_ = width;
      for (std::int64_t x = range_.x_lo >> 1; 2 * x < range_.x_hi; ++x)
        for (std::int64_t y = range_.y_lo; y < range_.y_hi; ++y) AddRun(x, y, width);
    }
    RunStrip();
  }

 private:
  static constexpr std::size_t kMostVectors = kStrip / hn::MaxLanes(Float());

  // Tiles that are neighbours in memory, from the beginning of row y on.
  void AddRun(std::int64_t x, std::int64_t y, std::ptrdiff_t count) {
    for (std::ptrdiff_t t = 0; t < count; t += FloatLanes()) {
      vectors_[vector_count_++] = {x, y + t / wrap_, range_.z_lo + t % wrap_,
                                   std::min(count - t, FloatLanes())};
      if (vector_count_ == kMostVectors) RunStrip();
    }
  }

  void RunStrip() {
    const std::span<const TileVector> vectors(vectors_, vector_count_);
    const std::ptrdiff_t count = static_cast<std::ptrdiff_t>(vector_count_) * FloatLanes();
    const std::ptrdiff_t pitch = GroupPitch(chain_.first.inputs);
    float* to = inputs_;
    for (const ConvSource& source : sources_) {
      const auto transform = source.upsampled ? TransformUpsampledTiles : TransformTiles;
      transform(source.planes, vectors, pitch, to);
      to += 4 * kStrip * source.planes.channels;
    }
    Slice<0>(count);
    Slice<1>(count);
    Slice<2>(count);
    Slice<3>(count);
    for (const ChannelLayer& layer : chain_.rest) {
      for (int voxel = 0; voxel < 8; ++voxel)
        Channels(layer, current_ + voxel * kStrip, 8 * kStrip, count, next_ + voxel * kStrip);
      std::swap(current_, next_);
    }
    for (std::size_t i = 0; i < vector_count_; ++i) StoreVector(i);
    vector_count_ = 0;
  }

  void StoreVector(std::size_t index) {
    const TileVector& vector = vectors_[index];
    const float* from = current_ + index * hn::MaxLanes(Float());
    for (int x = 0; x < 2; ++x, from += 4 * kStrip)
      if (2 * vector.x + x >= range_.x_lo && 2 * vector.x + x < range_.x_hi)
        StorePlane(vector, from, out_.plane(2 * vector.x + x));
  }

  // One x of a vector of tiles, row by row.
  void StorePlane(const TileVector& vector, const float* from, float* plane) {
    const std::ptrdiff_t width = range_.z_hi - range_.z_lo;
    std::ptrdiff_t z = vector.z - range_.z_lo;
    std::int64_t y = vector.y;
    for (std::ptrdiff_t t = 0; t < vector.count; ++y, z = 0) {
      const std::ptrdiff_t count = std::min(vector.count - t, width - z);
      if (count > 0) StoreRun(from + t, plane + out_.offset(y, range_.z_lo + z), count);
      t += wrap_ - z;
    }
  }

  // At most a vector of neighbouring tiles, for all channels and phases.
  void StoreRun(const float* from, float* to, std::ptrdiff_t count) {
    const Float d;
    const auto used = hn::FirstN(d, static_cast<std::size_t>(count));
    for (int o = 0; o < out_.channels; ++o, from += 8 * kStrip)
      for (int phase = 0; phase < 4; ++phase, to += out_.phase_pitch) {
        const Floats values = hn::LoadU(d, from + phase * kStrip);
        if (count == FloatLanes())
          hn::StoreU(values, d, to);
        else
          hn::BlendedStore(values, used, d, to);
      }
  }

  template <int kX>
  void Slice(std::ptrdiff_t count) {
    for (int y = 0; y < 4; ++y) Multiply(kX, y, count);
    OutputSlice<kX>(chain_.first, count, products_, current_);
  }

  // The terms of the products of each group (ix, iy), which are the same for all strips.
  void FindTerms() {
    for (int group = 0; group < kGroups; ++group) {
      int channel = 0;
      first_term_[group] = terms_.size();
      for (const ConvSource& source : sources_) {
        if (!source.upsampled || (group / 4 != 2 && group % 4 != 2))
          terms_.push_back(
              {chain_.first.at(group, channel),
               inputs_ + group * GroupPitch(chain_.first.inputs) + 4 * kStrip * channel,
               source.planes.channels, source.upsampled});
        channel += source.planes.channels;
      }
    }
    first_term_[kGroups] = terms_.size();
  }

  void Multiply(int x, int y, std::ptrdiff_t count) {
    const std::size_t first = first_term_[4 * x + y], end = first_term_[4 * x + y + 1];
    Products({&terms_[first], end - first}, chain_.first.outputs, count,
             products_ + 2 * y * kStrip);
  }

  const ConvChain& chain_;
  std::span<const ConvSource> sources_;
  const TileRange& range_;
  const Planes& out_;
  float* inputs_;           // see GroupPitch
  float* products_;         // [output][iy][z][tile]
  float *current_, *next_;  // [channel][voxel of a tile][tile]
  std::vector<ProductTerms> terms_;
  std::size_t first_term_[kGroups + 1];
  TileVector vectors_[kMostVectors];
  std::size_t vector_count_ = 0;
  std::ptrdiff_t wrap_ = 1;  // from one row of tiles to the next, in tiles
};

void WinogradConv3d(const ConvChain& chain, std::span<const ConvSource> sources,
                    const TileRange& range, const Planes& out, float* scratch) {
  Convolution(chain, sources, range, out, scratch).Run();
}

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace solidtex::engine::kernels {

HWY_EXPORT(WinogradConv3d);

std::size_t winograd_scratch(const ConvChain& chain) {
  const int floats_per_tile =
      64 * chain.first.inputs + 8 * chain.first.outputs + 16 * widest_layer(chain);
  return static_cast<std::size_t>(floats_per_tile) * kStrip + kGroups * kGroupPad;
}

void winograd_conv3d(const ConvChain& chain, std::span<const ConvSource> sources,
                     const TileRange& range, const Planes& out, float* scratch) {
  HWY_DYNAMIC_DISPATCH(WinogradConv3d)(chain, sources, range, out, scratch);
}

}  // namespace solidtex::engine::kernels
#endif
