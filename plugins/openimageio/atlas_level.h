// The UV atlas of a mesh as an image, with its mipmap.
#pragma once

#include <memory>
#include <vector>

#include "plugins/openimageio/level.h"
#include "plugins/openimageio/query.h"

namespace solidtex::openimageio {

// The levels of the atlas of query.mesh, down to one texel. Each level is averaged over the
// footprints of its own texels. Throws QueryError, or std::exception naming the mesh.
std::vector<std::unique_ptr<const Level>> atlas_levels(const Query& query);

}  // namespace solidtex::openimageio
