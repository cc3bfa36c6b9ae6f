#include <stdexcept>

#include "tools/bake/sink.h"

namespace solidtex::tools {

std::unique_ptr<Sink> make_vdb_sink(const std::filesystem::path&, const Volume&) {
  throw std::runtime_error(
      "this solidtex-bake was built without OpenVDB and cannot write .vdb (install libopenvdb-dev, "
      "configure with SOLIDTEX_WITH_OPENVDB=ON)");
}

}  // namespace solidtex::tools
