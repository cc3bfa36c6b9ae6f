#include "engine/field/operations.h"

#include <algorithm>
#include <vector>

namespace solidtex::engine {

namespace {

// Lattice coordinates are taken modulo 2^32.
std::int32_t wrap(std::int64_t i) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(i));
}

template <class Visit>
void for_each_row(const Volume& volume, Visit visit) {
  for (int c = 0; c < volume.channels; ++c)
    for (std::int64_t x = 0; x < volume.size[0]; ++x)
      for (std::int64_t y = 0; y < volume.size[1]; ++y) visit(c, x, y, volume.row(c, x, y));
}

}  // namespace

void fill_noise(NoiseScheme scheme, std::uint64_t seed, int level, Distribution distribution,
                const Block& out) {
  const auto& lo = out.box().lo;
  std::vector<NoiseStream> streams;
  for (int c = 0; c < out.volume().channels; ++c)
    streams.emplace_back(scheme, seed, static_cast<std::uint32_t>(level),
                         static_cast<std::uint32_t>(c));
  for_each_row(out.volume(), [&](int c, std::int64_t x, std::int64_t y, float* row) {
    streams[static_cast<std::size_t>(c)].row(distribution, wrap(lo[0] + x), wrap(lo[1] + y),
                                             wrap(lo[2]), static_cast<int>(out.box().size(2)), row);
  });
}

void upsample(const Block& in, const Block& out) {
  const auto& lo = out.box().lo;
  const auto& in_lo = in.box().lo;
  const ConstVolume source = in.volume();
  for_each_row(out.volume(), [&](int c, std::int64_t x, std::int64_t y, float* row) {
    const float* from = source.row(c, ((lo[0] + x) >> 1) - in_lo[0], ((lo[1] + y) >> 1) - in_lo[1]);
    for (std::int64_t z = 0; z < out.box().size(2); ++z)
      row[z] = from[((lo[2] + z) >> 1) - in_lo[2]];
  });
}

void copy_channels(const Block& in, const Block& out, int first_channel) {
  const ConstVolume source = in.view(out.box());
  Volume target = out.volume();
  target.data += first_channel * target.channel_pitch;
  target.channels = source.channels;
  for_each_row(target, [&](int c, std::int64_t x, std::int64_t y, float* row) {
    std::copy_n(source.row(c, x, y), out.box().size(2), row);
  });
}

void interleave(const Block& in, float* values) {
  const Volume& source = in.volume();
  for (std::int64_t x = 0; x < source.size[0]; ++x)
    for (std::int64_t y = 0; y < source.size[1]; ++y)
      for (std::int64_t z = 0; z < source.size[2]; ++z)
        for (int c = 0; c < source.channels; ++c) *values++ = source.row(c, x, y)[z];
}

}  // namespace solidtex::engine
