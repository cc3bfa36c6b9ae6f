// Winograd convolutions on the active target. See winograd.h.
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
#include "engine/kernels/direct-inl.h"
#include "engine/kernels/winograd_inputs-inl.h"
#include "engine/kernels/winograd_products-inl.h"

HWY_BEFORE_NAMESPACE();
namespace solidtex::engine::HWY_NAMESPACE {

// One call's work, in strips of at most kStrip tiles.
template <int kTile>
class Convolution {
 public:
  Convolution(const ConvChain& chain, std::span<const ConvSource> sources, const TileRange& range,
              const Planes& out, float* scratch)
      : chain_(chain),
        sources_(sources),
        range_(range),
        out_(out),
        origin_x_(kTile == 1 ? 0 : chain.origin) {
    const ScratchSizes sizes(chain);
    inputs_ = scratch;
    products_ = inputs_ + sizes.inputs;
    slots_ = products_ + sizes.products;
    layers_[0] = slots_ + sizes.slots;
    layers_[1] = layers_[0] + sizes.layer;
    results_ = layers_[1] + sizes.layer;
    for (int voxel = 0; voxel < 4; ++voxel) {
      const int y = voxel / 2 + chain.origin, z = voxel % 2 + chain.origin;
      offsets_[voxel] =
          (y >> 1) * out.row_pitch + (z >> 1) + (2 * (y & 1) + (z & 1)) * out.parity_pitch;
    }
    if constexpr (kTile > 1) FindTerms();
  }

  // Runs of tiles keep to their rows or continue across rows, whichever needs fewer vectors. Runs
  // across rows need equal row pitches of all sources and also compute what lies between rows.
  // Short runs of small regions share vectors.
  void Run() {
    const std::ptrdiff_t width = range_.z_hi - range_.z_lo, rows = range_.y_hi - range_.y_lo;
    const std::ptrdiff_t pitch = sources_[0].planes.row_pitch, lanes = FloatLanes();
    bool same_pitch = true;
    for (const ConvSource& source : sources_) same_pitch &= source.planes.row_pitch == pitch;
    const std::ptrdiff_t run = (rows - 1) * pitch + width;
    const auto vectors = [lanes](std::ptrdiff_t count) { return (count + lanes - 1) / lanes; };
    const bool wraps = same_pitch && vectors(run) < rows * vectors(width);
    wrap_ = wraps ? pitch : width;
    const std::ptrdiff_t length = wraps ? run : width;
    joins_ = kIdleShare * (vectors(length) * lanes - length) > length;
    const std::int64_t x_hi = range_.x_hi - origin_x_;
    for (std::int64_t x = (range_.x_lo - origin_x_) >> kShift; x << kShift < x_hi; ++x)
      if (wraps)
        AddRun(x, range_.y_lo, run);
      else
        for (std::int64_t y = range_.y_lo; y < range_.y_hi; ++y) AddRun(x, y, width);
    RunStrip();
  }

 private:
  static constexpr std::size_t kMaxVectors = kStrip / hn::MaxLanes(Float());
  static constexpr int kShift = kTile / 2;  // from voxels to tiles along x
  static constexpr int kGroups = 4 * (kTile + 2);
  static constexpr int kVoxels = 4 * kTile;
  // Runs share vectors if more than one lane in kIdleShare would be idle: shared vectors are loaded
  // twice or more.
  static constexpr std::ptrdiff_t kIdleShare = 16;

  // Adds contiguous tiles from the beginning of row y on.
  void AddRun(std::int64_t x, std::int64_t y, std::ptrdiff_t count) {
    for (std::ptrdiff_t t = 0; t < count;) {
      TileVector& vector = VectorWithRoom();
      const std::ptrdiff_t lane = vector.used();
      const std::ptrdiff_t part = std::min(count - t, FloatLanes() - lane);
      vector.runs[vector.size++] = {x, y + t / wrap_, range_.z_lo + t % wrap_, lane, part};
      t += part;
    }
  }

  TileVector& VectorWithRoom() {
    if (vector_count_ > 0) {
      TileVector& last = vectors_[vector_count_ - 1];
      if (joins_ && last.used() < FloatLanes() && last.size < TileVector::kMaxRuns) return last;
    }
    if (vector_count_ == kMaxVectors) RunStrip();
    TileVector& next = vectors_[vector_count_++];
    next.size = 0;
    return next;
  }

  void RunStrip() {
    if (vector_count_ == 0) return;
    const std::span<const TileVector> vectors(vectors_, vector_count_);
    const auto joined = [](const TileVector& vector) { return vector.size > 1; };
    std::ranges::any_of(vectors, joined) ? RunFirst<true>(vectors) : RunFirst<false>(vectors);
    if (!chain_.rest.empty())
      for (int voxel = 0; voxel < kVoxels; ++voxel)
        if (IsWanted(vectors.front().first(), voxel / 4) ||
            IsWanted(vectors.back().last(), voxel / 4))
          RunRest(voxel, Count(vectors));
    for (std::size_t i = 0; i < vector_count_; ++i)
      if (!IsStoredInPlace(vectors_[i])) StoreVector(i);
    vector_count_ = 0;
  }

  static std::ptrdiff_t Count(std::span<const TileVector> vectors) {
    return static_cast<std::ptrdiff_t>(vectors.size()) * FloatLanes();
  }

  // Evaluates the 3^3 convolution of a strip.
  template <bool kJoined>
  void RunFirst(std::span<const TileVector> vectors) {
    if constexpr (kTile == 1) {
      TapTarget targets[kMaxVectors];
      for (std::size_t i = 0; i < vectors.size(); ++i) targets[i] = Target(i);
      SumTaps<kJoined>(chain_.taps, sources_[0].planes, vectors, chain_.origin, targets);
    } else {
      RunTiles<kJoined>(vectors);
    }
  }

  TapTarget Target(std::size_t index) const {
    const TileRun& run = vectors_[index].first();
    if (IsStoredInPlace(vectors_[index]))
      return {out_.plane(Voxel(run, 0)) + out_.offset(run.y, run.z),
              out_.channel_pitch(),
              {offsets_[0], offsets_[1], offsets_[2], offsets_[3]}};
    return {slots_ + index * hn::MaxLanes(Float()),
            kSlots<1> * kStrip,
            {0, kStrip, 2 * kStrip, 3 * kStrip}};
  }

  // Returns whether sums of taps can be stored straight into the result.
  bool IsStoredInPlace(const TileVector& vector) const {
    return kTile == 1 && chain_.rest.empty() && out_.channels % kTapOutputs == 0 &&
           vector.size == 1 && vector.first().count == FloatLanes() && RowsFollow();
  }

  // Returns whether runs across rows may be stored as they are. Tiles at odd coordinates leave room
  // for the tile between two rows: even values before a row and odd ones after it.
  bool RowsFollow() const {
    return wrap_ == out_.row_pitch && wrap_ - (range_.z_hi - range_.z_lo) <= chain_.origin;
  }

  template <bool kJoined>
  void RunTiles(std::span<const TileVector> vectors) {
    const WinogradLayer& layer = chain_.first;
    const std::ptrdiff_t count = Count(vectors);
    float* to = inputs_;
    for (const ConvSource& source : sources_) {
      if (source.upsampled)
        TransformUpsampledTiles<kJoined>(source.planes, vectors, to);
      else
        TransformTiles<kTile, kJoined>(source.planes, vectors, chain_.origin, to);
      to += kInputPitch<kTile> * source.planes.channels;
    }
    for (int x = 0; x < kTile + 2; ++x) {
      for (int y = 0; y < 4; ++y) Multiply(4 * x + y, count, products_ + 2 * y * kStrip);
      OutputAlongY<kTile>(layer.outputs, count, products_, slots_ + 4 * x * kStrip);
    }
    OutputAlongX<kTile>(layer, count, slots_);
  }

  // Evaluates the 1^3 convolutions of one voxel of each tile.
  void RunRest(int voxel, std::ptrdiff_t count) {
    const float* from = slots_ + voxel * kStrip;
    std::ptrdiff_t pitch = kSlots<kTile> * kStrip;
    for (const ChannelLayer& layer : chain_.rest) {
      const bool last = &layer == &chain_.rest.back();
      float* to = last ? results_ + voxel * kStrip : layers_[(&layer - &chain_.rest[0]) % 2];
      const std::ptrdiff_t to_pitch = last ? kVoxels * kStrip : kStrip;
      Channels(layer, from, pitch, count, to, to_pitch);
      from = to, pitch = to_pitch;
    }
  }

  void StoreVector(std::size_t index) {
    const float* voxels = (chain_.rest.empty() ? slots_ : results_) + index * hn::MaxLanes(Float());
    const TileVector& vector = vectors_[index];
    for (const TileRun& run : std::span(vector.runs, static_cast<std::size_t>(vector.size)))
      for (int x = 0; x < kTile; ++x)
        if (IsWanted(run, x))
          StorePlane(run, voxels + 4 * x * kStrip + run.lane, out_.plane(Voxel(run, x)));
  }

  std::int64_t Voxel(const TileRun& run, int x) const { return kTile * run.x + origin_x_ + x; }

  bool IsWanted(const TileRun& run, int x) const {
    return Voxel(run, x) >= range_.x_lo && Voxel(run, x) < range_.x_hi;
  }

  // Stores both y and z of some tiles at one x, row by row unless the rows of the result are
  // contiguous too.
  void StorePlane(const TileRun& run, const float* from, float* plane) {
    if (RowsFollow()) return StoreRun(from, plane + out_.offset(run.y, run.z), run.count);
    const std::ptrdiff_t width = range_.z_hi - range_.z_lo;
    std::ptrdiff_t z = run.z - range_.z_lo;
    std::int64_t y = run.y;
    for (std::ptrdiff_t t = 0; t < run.count; ++y, z = 0) {
      const std::ptrdiff_t count = std::min(run.count - t, width - z);
      if (count > 0) StoreRun(from + t, plane + out_.offset(y, range_.z_lo + z), count);
      t += wrap_ - z;
    }
  }

  // Stores at most a vector of contiguous tiles for all channels and parities.
  void StoreRun(const float* from, float* to, std::ptrdiff_t count) {
    const Float d;
    const auto used = hn::FirstN(d, static_cast<std::size_t>(count));
    const std::ptrdiff_t pitch = (chain_.rest.empty() ? kSlots<kTile> : kVoxels) * kStrip;
    for (int o = 0; o < out_.channels; ++o, from += pitch, to += out_.channel_pitch())
      for (int voxel = 0; voxel < 4; ++voxel) {
        const Floats values = hn::LoadU(d, from + voxel * kStrip);
        if (count == FloatLanes())
          hn::StoreU(values, d, to + offsets_[voxel]);
        else
          hn::BlendedStore(values, used, d, to + offsets_[voxel]);
      }
  }

  // Finds the terms of the products of each group (ix, iy), the same for all strips.
  void FindTerms() {
    for (int group = 0; group < kGroups; ++group) {
      int channel = 0;
      first_term_[group] = terms_.size();
      for (const ConvSource& source : sources_) {
        if (!source.upsampled || (group / 4 != 2 && group % 4 != 2)) {
          const int from = source.upsampled ? 4 * (group / 4 % 3) + group % 4 % 3 : group;
          terms_.push_back({chain_.first.at(group, channel),
                            inputs_ + channel * kInputPitch<kTile> + from * 4 * kStrip,
                            kInputPitch<kTile>, source.planes.channels, source.upsampled});
        }
        channel += source.planes.channels;
      }
    }
    first_term_[kGroups] = terms_.size();
  }

  void Multiply(int group, std::ptrdiff_t count, float* to) {
    const std::size_t first = first_term_[group], end = first_term_[group + 1];
    Products({&terms_[first], end - first}, chain_.first.outputs, count, to);
  }

  const ConvChain& chain_;
  std::span<const ConvSource> sources_;
  const TileRange& range_;
  const Planes& out_;
  const int origin_x_;
  float* inputs_;     // see kInputPitch
  float* products_;   // [output][iy][z][tile]
  float* slots_;      // [output][slot][tile]
  float* layers_[2];  // [channel][tile]
  float* results_;    // [output][voxel][tile]
  std::vector<ProductTerms> terms_;
  std::size_t first_term_[kGroups + 1];
  std::ptrdiff_t offsets_[4];  // from a tile's place in a result's plane to its voxels
  TileVector vectors_[kMaxVectors];
  std::size_t vector_count_ = 0;
  std::ptrdiff_t wrap_ = 1;  // from one row of tiles to the next, in tiles
  bool joins_ = false;
};

void WinogradConv3d(const ConvChain& chain, std::span<const ConvSource> sources,
                    const TileRange& range, const Planes& out, float* scratch) {
  const auto run = [&](auto convolution) { convolution.Run(); };
  if (chain.tile() == 1) return run(Convolution<1>(chain, sources, range, out, scratch));
  if (chain.tile() == 2) return run(Convolution<2>(chain, sources, range, out, scratch));
  run(Convolution<4>(chain, sources, range, out, scratch));
}

}  // namespace solidtex::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace solidtex::engine::kernels {

HWY_EXPORT(WinogradConv3d);

std::size_t winograd_scratch(const ConvChain& chain) {
  const ScratchSizes sizes(chain);
  return static_cast<std::size_t>(sizes.inputs + sizes.products + sizes.slots + 2 * sizes.layer +
                                  sizes.results + kStrip);  // results are loaded in whole vectors
}

void winograd_conv3d(const ConvChain& chain, std::span<const ConvSource> sources,
                     const TileRange& range, const Planes& out, float* scratch) {
  HWY_DYNAMIC_DISPATCH(WinogradConv3d)(chain, sources, range, out, scratch);
}

}  // namespace solidtex::engine::kernels
#endif
