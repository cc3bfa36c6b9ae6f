// Image files, as textures of a scene and as photographs for an encoder: every one is refused with
// an error that names the file, or read. A name without an ending lets OpenImageIO try all formats,
// which takes long, so files that begin like a common format have its ending.
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
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

// The ending of a format whose files begin so, or none.
const char* ending_of(std::string_view bytes) {
  static constexpr std::pair<std::string_view, const char*> kFormats[] = {
      {"\x89PNG", ".png"}, {"\xff\xd8", ".jpg"}, {"\x76\x2f\x31\x01", ".exr"},
      {"II*", ".tif"},     {"MM", ".tif"},       {"BM", ".bmp"},
      {"RIFF", ".webp"},   {"P6", ".ppm"},       {"GIF8", ".gif"}};
  for (const auto& [beginning, ending] : kFormats)
    if (bytes.starts_with(beginning)) return ending;
  return "";
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace solidtex::pathtracer;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const InputFile file(std::string("image") + ending_of(bytes));
  file.write(data, size);
  expect_read_or_refused<SceneError>(file, [&] {
    std::vector<std::string> notes;
    read_image(file.path(), ImageEncoding::automatic, ImageRange::unit, notes);
  });
  expect_read_or_refused<std::runtime_error>(
      file, [&] { solidtex::tools::read_photograph(file.path(), 4, 2); });
  return 0;
}
