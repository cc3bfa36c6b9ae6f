// Stands in for mesh_job.cpp in a build without GLM.
#include <stdexcept>

#include "tools/bake/mesh_job.h"

namespace solidtex::tools {

void check_mesh_options(const BakeOptions& options) {
  throw std::runtime_error("--mesh " + options.mesh.string() +
                           ": found a build without GLM, which meshes need (libglm-dev)");
}

void bake_mesh(const BakeOptions& options, const solidtex::texture&, const std::filesystem::path&) {
  check_mesh_options(options);
}

}  // namespace solidtex::tools
