// Image files, as textures of a scene and as photographs for an encoder: every one is refused with
// an error that names the file, or read. Its first bytes choose the reader. Named like a TGA, a
// file that begins like no format goes to that reader.
#include <stdexcept>
#include <string>
#include <vector>

#include "plugins/pathtracer/reader/image_reader.h"
#include "solidtex/pathtracer.hpp"
#include "tests/fuzz/input_file.h"
#include "tools/encode/photograph.h"

namespace {

template <class Error, class Read>
void expect_read_or_refused(const InputFile& file, const Read& read) {
  try {
    read();
  } catch (const Error& error) {
    if (std::string(error.what()).find(file.path()) == std::string::npos) throw;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace solidtex::pathtracer;
  static const InputFile file("image.tga");
  file.write(data, size);
  expect_read_or_refused<SceneError>(file, [] {
    std::vector<std::string> notes;
    read_image(file.path(), ImageEncoding::automatic, ImageRange::unit, notes);
  });
  expect_read_or_refused<std::runtime_error>(
      file, [] { solidtex::tools::read_photograph(file.path(), 4, 2); });
  return 0;
}
