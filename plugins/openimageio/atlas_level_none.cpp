// Stands in for atlas_level.cpp in a build without GLM.
#include "plugins/openimageio/atlas_level.h"

namespace solidtex::openimageio {

std::vector<std::unique_ptr<const Level>> atlas_levels(const Query&) {
  throw QueryError("the query has a mesh, expected none: built without meshes (libglm-dev)");
}

}  // namespace solidtex::openimageio
