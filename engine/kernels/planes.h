// Views of planes along x, which Winograd convolutions read and write.
//
// Within a channel a plane is split by the parities of y and z. A vector holds neighboring tiles
// of 2 x 2 voxels and continues from one row of tiles to the next.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace solidtex::engine {

// Value (channel, x, 2 Y + py, 2 Z + pz) is plane(x)[(4 * channel + 2 * py + pz) * parity_pitch +
// (Y - y_lo) * row_pitch + Z - z_lo]. Without a parity split (parities = 1) Y and Z are y and z.
// Planes form a ring.
template <class Value>
struct BasicPlanes {
  Value* data = nullptr;
  int channels = 0, parities = 4;
  std::int64_t x_lo = 0, x_hi = 0;
  std::int64_t ring_size = 1;  // planes in memory; an x that is not kept shares one
  std::int64_t x_first = 0;    // the first plane in memory holds this x modulo ring_size
  std::int64_t y_lo = 0, z_lo = 0, rows = 0;
  std::ptrdiff_t row_pitch = 0, parity_pitch = 0;

  std::ptrdiff_t channel_pitch() const { return parities * parity_pitch; }
  std::ptrdiff_t plane_pitch() const { return channels * channel_pitch(); }

  // No division for nearby x and no branches: either costs a tenth of a small convolution.
  Value* plane(std::int64_t x) const {
    std::int64_t slot = x - x_first;
    if (slot < -ring_size || slot >= 2 * ring_size) slot %= ring_size;
    slot += slot < 0 ? ring_size : 0;
    slot -= slot >= ring_size ? ring_size : 0;
    return data + slot * plane_pitch();
  }
  // Returns the offset of a tile in a plane.
  std::ptrdiff_t offset(std::int64_t tile_y, std::int64_t tile_z) const {
    return (tile_y - y_lo) * row_pitch + tile_z - z_lo;
  }
};

struct Planes : BasicPlanes<float> {};

struct ConstPlanes : BasicPlanes<const float> {
  ConstPlanes() = default;
  ConstPlanes(const Planes& p)
      : BasicPlanes{p.data,    p.channels, p.parities, p.x_lo, p.x_hi,      p.ring_size,
                    p.x_first, p.y_lo,     p.z_lo,     p.rows, p.row_pitch, p.parity_pitch} {}
};

}  // namespace solidtex::engine
