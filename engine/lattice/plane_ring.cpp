#include "engine/lattice/plane_ring.h"

#include <algorithm>

namespace solidtex::engine {

namespace {

constexpr std::ptrdiff_t kLine = 16;  // floats of a cache line

// A convolution reads one cache line of each parity of each channel at a time. Their pitch in lines
// is 8 modulo 16, so that they do not share few sets of the first-level cache.
std::ptrdiff_t spread(std::ptrdiff_t floats) {
  const std::ptrdiff_t lines = (floats + kLine - 1) / kLine;
  return (lines + (24 - lines % 16) % 16) * kLine;
}

// Interleaves even and odd values, which begin at the same tile, into z_lo .. z_hi.
void join(const float* even, const float* odd, std::int64_t z_lo, std::int64_t z_hi,
          float* __restrict values) {
  std::int64_t count = z_hi - z_lo;
  if (count > 0 && (z_lo & 1) != 0) *values++ = *odd++, ++even, --count;
  for (std::int64_t i = 0; i < count / 2; ++i) values[2 * i] = even[i], values[2 * i + 1] = odd[i];
  if (count % 2 == 1) values[count - 1] = even[count / 2];
}

}  // namespace

TileRange tile_range(const Box& box, int origin) {
  const auto first = [&](int axis) { return (box.lo[axis] - origin) >> 1; };
  const auto end = [&](int axis) { return (box.hi[axis] - origin + 1) >> 1; };
  return {box.lo[0], box.hi[0], first(1), end(1), first(2), end(2)};
}

Box whole_tiles_across(Box box, int origin) {
  const TileRange tiles = tile_range(box, origin);
  box.lo[1] = 2 * tiles.y_lo + origin, box.hi[1] = 2 * tiles.y_hi + origin;
  box.lo[2] = 2 * tiles.z_lo + origin, box.hi[2] = 2 * tiles.z_hi + origin;
  return box;
}

PlaneRing::PlaneRing(const Box& box, int channels, int parities, std::int64_t planes) {
  const int step = parities == 4 ? 1 : 0;  // as a shift
  planes_.channels = channels;
  planes_.parities = parities;
  planes_.ring_size = planes;
  planes_.y_lo = box.lo[1] >> step;
  planes_.z_lo = box.lo[2] >> step;
  planes_.rows = ((box.hi[1] + step) >> step) - planes_.y_lo;
  planes_.row_pitch = ((box.hi[2] + step) >> step) - planes_.z_lo;
  planes_.parity_pitch = spread(planes_.rows * planes_.row_pitch);
}

// Convolutions read up to a row, a tile and a vector beyond a plane. Rounded to cache lines, so
// that planes begin with one.
std::size_t PlaneRing::slack() const {
  return (static_cast<std::size_t>(planes_.row_pitch) + kReadSlack + kLine - 1) / kLine * kLine;
}

std::size_t PlaneRing::memory() const {
  return static_cast<std::size_t>(planes_.plane_pitch() * planes_.ring_size) + 2 * slack();
}

void PlaneRing::use(float* memory) { planes_.data = memory + slack(); }

void PlaneRing::slide(std::int64_t lo, std::int64_t hi) {
  planes_.x_lo = lo;
  planes_.x_hi = hi;
  planes_.x_first = lo - ((lo % planes_.ring_size) + planes_.ring_size) % planes_.ring_size;
}

float* PlaneRing::row(int channel, std::int64_t x, std::int64_t y) const {
  float* plane = planes_.plane(x) + channel * planes_.channel_pitch();
  if (planes_.parities == 1) return plane + planes_.offset(y, planes_.z_lo);
  return plane + (y & 1) * 2 * planes_.parity_pitch + planes_.offset(y >> 1, planes_.z_lo);
}

void PlaneRing::read(int channel, std::int64_t x, std::int64_t y, std::int64_t z_lo,
                     std::int64_t z_hi, float* values) const {
  const float* even = row(channel, x, y);
  const float* odd = even + planes_.parity_pitch;
  if (planes_.parities == 1) {
    std::copy(even + (z_lo - planes_.z_lo), even + (z_hi - planes_.z_lo), values);
    return;
  }
  const std::int64_t tile = (z_lo >> 1) - planes_.z_lo;
  join(even + tile, odd + tile, z_lo, z_hi, values);
}

void PlaneRing::join_planes(const PlaneRing& from, const Box& box) const {
  const Planes &in = from.planes_, &out = planes_;
  const std::ptrdiff_t in_z = (box.lo[2] >> 1) - in.z_lo, out_z = box.lo[2] - out.z_lo;
  for (std::int64_t x = box.lo[0]; x < box.hi[0]; ++x)
    for (int c = 0; c < out.channels; ++c) {
      const float* parities = in.plane(x) + c * in.channel_pitch() + in_z;
      float* to = out.plane(x) + c * out.channel_pitch() + out_z;
      for (std::int64_t y = box.lo[1]; y < box.hi[1]; ++y) {
        const float* even =
            parities + (y & 1) * 2 * in.parity_pitch + ((y >> 1) - in.y_lo) * in.row_pitch;
        join(even, even + in.parity_pitch, box.lo[2], box.hi[2],
             to + (y - out.y_lo) * out.row_pitch);
      }
    }
}

void PlaneRing::write(int channel, std::int64_t x, std::int64_t y, std::int64_t z_lo,
                      std::int64_t z_hi, const float* values) const {
  float* even = row(channel, x, y);
  float* odd = even + planes_.parity_pitch;
  if (planes_.parities == 1) {
    std::copy(values, values + (z_hi - z_lo), even + (z_lo - planes_.z_lo));
    return;
  }
  std::int64_t tile = (z_lo >> 1) - planes_.z_lo, z = z_lo;
  if (z < z_hi && (z & 1) != 0) odd[tile++] = *values++, ++z;
  for (; z + 2 <= z_hi; z += 2, ++tile, values += 2) even[tile] = values[0], odd[tile] = values[1];
  if (z < z_hi) even[tile] = *values;
}

}  // namespace solidtex::engine
