// Winograd convolutions on the machine's best target. See winograd.h.
#include "engine/kernels/winograd.h"

#include "engine/kernels/targets.h"
// foreach_target.h includes this file once per target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/kernels/winograd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "engine/kernels/channels-inl.h"
#include "engine/kernels/winograd_inputs-inl.h"
#include "engine/kernels/winograd_products-inl.h"

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

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
