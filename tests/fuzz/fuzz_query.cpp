// Query strings of the OpenImageIO plugin: every one is refused with a QueryError, or read.
#include <cstddef>
#include <cstdint>
#include <string>

#include "plugins/openimageio/query.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace solidtex::openimageio;
  try {
    parse_query(std::string(reinterpret_cast<const char*>(data), size));
  } catch (const QueryError&) {
  }
  return 0;
}
