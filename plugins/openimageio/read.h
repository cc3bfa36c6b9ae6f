// Converts a region of a level to pixels in memory.
#pragma once

#include <OpenImageIO/imageio.h>

#include "plugins/openimageio/level.h"

namespace solidtex::openimageio {

// Destination of pixels and its layout, as in OpenImageIO's ImageInput::read_tiles.
struct Target {
  void* data;
  OIIO::TypeDesc format;  // UNKNOWN: the image's own
  OIIO::stride_t xstride, ystride, zstride;
  int chbegin, chend;
};

// Reads a region of at least one voxel, in pieces of bounded memory. A region of one tile is read
// on the calling thread, because hosts read tiles on all their threads. Larger regions use the
// calling thread's oneTBB arena. Throws solidtex::error.
void read_region(const texture& texture, const Level& level, const OIIO::ImageSpec& spec,
                 const Region& region, Target target);

}  // namespace solidtex::openimageio
