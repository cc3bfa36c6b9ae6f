// A node's values while a box is evaluated along x: the planes that later nodes still need.
#pragma once

#include <cstddef>
#include <cstdint>

#include "engine/common/box.h"
#include "engine/kernels/planes.h"
#include "engine/kernels/volume.h"
#include "engine/kernels/winograd.h"

namespace solidtex::engine {

// What a convolution computes of a box in tiles that begin at 2 t + origin, and the box that it
// writes: tiles are whole along y and z.
TileRange tile_range(const Box& box, int origin);
Box whole_tiles_across(Box box, int origin);

class PlaneRing {
 public:
  PlaneRing() = default;

  // For `channels` on the y and z of a box, at most `planes` planes of x at a time. parities 4:
  // split by the parities of y and z; 1: as they are.
  PlaneRing(const Box& box, int channels, int parities, std::int64_t planes);

  // Floats of memory to use, with what convolutions may read before and behind.
  std::size_t memory() const;
  void use(float* memory);

  bool empty() const { return planes_.x_lo == planes_.x_hi; }
  // Planes [lo, hi) are the ones that are kept from now on.
  void slide(std::int64_t lo, std::int64_t hi);

  const Planes& planes() const { return planes_; }

  // Values (x, y, z_lo .. z_hi) of a channel, to and from plain order.
  void read(int channel, std::int64_t x, std::int64_t y, std::int64_t z_lo, std::int64_t z_hi,
            float* values) const;
  void write(int channel, std::int64_t x, std::int64_t y, std::int64_t z_lo, std::int64_t z_hi,
             const float* values) const;

  // Fills a box of this ring of one parity from one of four.
  void join_planes(const PlaneRing& from, const Box& box) const;

 private:
  std::size_t slack() const;
  // The first value of a row; the odd z, where they are apart, are a parity behind.
  float* row(int channel, std::int64_t x, std::int64_t y) const;

  Planes planes_;
};

}  // namespace solidtex::engine
