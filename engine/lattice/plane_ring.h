// Plane ring buffer: the planes of a node that later steps along x need.
#pragma once

#include <cstddef>
#include <cstdint>

#include "engine/common/box.h"
#include "engine/kernels/planes.h"
#include "engine/kernels/volume.h"
#include "engine/kernels/winograd.h"

namespace solidtex::engine {

// Returns the tiles that a convolution computes for a box, and the box that it writes. Tiles begin
// at 2 t + origin and are whole along y and z.
TileRange tile_range(const Box& box, int origin);
Box whole_tiles_across(Box box, int origin);

class PlaneRing {
 public:
  PlaneRing() = default;

  // Holds at most `planes` planes with the y and z of a box. `parities` is 4 for a parity split of
  // y and z, or 1 for none.
  PlaneRing(const Box& box, int channels, int parities, std::int64_t planes);

  // Floats of memory to pass to use(), including the margin that convolutions read.
  std::size_t memory() const;
  void use(float* memory);

  bool empty() const { return planes_.x_lo == planes_.x_hi; }
  // Keeps the planes [lo, hi) from now on.
  void slide(std::int64_t lo, std::int64_t hi);

  const Planes& planes() const { return planes_; }

  // Copies the values (x, y, z_lo .. z_hi) of a channel from and to plain order.
  void read(int channel, std::int64_t x, std::int64_t y, std::int64_t z_lo, std::int64_t z_hi,
            float* values) const;
  void write(int channel, std::int64_t x, std::int64_t y, std::int64_t z_lo, std::int64_t z_hi,
             const float* values) const;

  // Fills a box of this ring, which has no parity split, from a ring that has one.
  void join_planes(const PlaneRing& from, const Box& box) const;

 private:
  std::size_t slack() const;
  // Returns the first value of a row. With a parity split odd z follow one parity_pitch later.
  float* row(int channel, std::int64_t x, std::int64_t y) const;

  Planes planes_;
};

}  // namespace solidtex::engine
