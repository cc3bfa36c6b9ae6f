// Mesh files of one format, SOLIDTEX_READ: every file is refused with a MeshError, or read.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "plugins/mesh/formats/readers.h"
#include "plugins/mesh/mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace solidtex::mesh;
  try {
    SOLIDTEX_READ("fuzz", std::string_view(reinterpret_cast<const char*>(data), size));
  } catch (const MeshError&) {
  }
  return 0;
}
