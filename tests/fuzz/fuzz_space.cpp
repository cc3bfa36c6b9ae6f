// Texture spaces, with the encoder inside: every file is refused with an Error, or can be decoded.
#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/common/error.h"
#include "engine/space/space.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace solidtex::engine;
  try {
    parse_space(std::span(reinterpret_cast<const std::byte*>(data), size), "fuzz");
  } catch (const Error&) {
  }
  return 0;
}
