// Views of values kept in planes of x: what a Winograd convolution reads and writes.
//
// Within a channel a plane is split by the parities of y and z, so that a vector holds neighbouring
// tiles of two by two voxels, and goes on from one row of tiles to the next.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace solidtex::engine {

// Value (channel, x, 2 Y + py, 2 Z + pz) is
// plane(x)[(4 * channel + 2 * py + pz) * parity_pitch + (Y - y_lo) * row_pitch + Z - z_lo].
// With one parity Y and Z are y and z themselves. Planes of x are kept in a ring.
template <class Value>
struct BasicPlanes {
  Value* data = nullptr;
  int channels = 0, parities = 4;
  std::int64_t x_lo = 0, x_hi = 0;
  std::int64_t ring = 1;     // planes; any x finds one: if it is not kept any more, another's
  std::int64_t x_first = 0;  // the first plane in memory is that of this x, modulo ring
  std::int64_t y_lo = 0, z_lo = 0, rows = 0;
  std::ptrdiff_t row_pitch = 0, parity_pitch = 0;

  std::ptrdiff_t channel_pitch() const { return parities * parity_pitch; }
  std::ptrdiff_t plane_pitch() const { return channels * channel_pitch(); }

  // Without a division where x is near, which took a tenth of the time of a small convolution, and
  // without branches, which were not foreseen.
  Value* plane(std::int64_t x) const {
    std::int64_t slot = x - x_first;
    if (slot < -ring || slot >= 2 * ring) slot %= ring;
    slot += slot < 0 ? ring : 0;
    slot -= slot >= ring ? ring : 0;
    return data + slot * plane_pitch();
  }
  // From the first value of a plane.
  std::ptrdiff_t offset(std::int64_t tile_y, std::int64_t tile_z) const {
    return (tile_y - y_lo) * row_pitch + tile_z - z_lo;
  }
};

struct Planes : BasicPlanes<float> {};

struct ConstPlanes : BasicPlanes<const float> {
  ConstPlanes() = default;
  ConstPlanes(const Planes& p)
      : BasicPlanes{p.data,    p.channels, p.parities, p.x_lo, p.x_hi,      p.ring,
                    p.x_first, p.y_lo,     p.z_lo,     p.rows, p.row_pitch, p.parity_pitch} {}
};

}  // namespace solidtex::engine
