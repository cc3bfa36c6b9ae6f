// The UV atlas of a mesh as an image, with its mipmap.
#pragma once

#include <memory>
#include <vector>

#include "plugins/openimageio/level.h"
#include "plugins/openimageio/query.h"

namespace solidtex::openimageio {

// The atlas of query.mesh and its mipmap, down to one texel. Every level is evaluated by itself,
// for what its own texels cover. Throws QueryError, or std::exception with a message that names the
// mesh.
std::vector<std::unique_ptr<const Level>> atlas_levels(const Query& query);

}  // namespace solidtex::openimageio
