// From a region of a level to pixels in memory.
#pragma once

#include <OpenImageIO/imageio.h>

#include "plugins/openimageio/level.h"

namespace solidtex::openimageio {

// Where pixels go and how they lie there, as in OpenImageIO's ImageInput::read_tiles.
struct Target {
  void* data;
  OIIO::TypeDesc format;  // UNKNOWN: the image's own
  OIIO::stride_t xstride, ystride, zstride;
  int chbegin, chend;
};

// Reads a region of at least one voxel, in pieces of bounded memory. A region of one tile stays on
// the calling thread: a host that asks for tiles does so from all of its threads. Larger ones use
// the calling thread's oneTBB arena. Throws solidtex::error.
void read_region(const texture& texture, const Level& level, const OIIO::ImageSpec& spec,
                 const Region& region, Target target);

}  // namespace solidtex::openimageio
