// Scene files, alone in an empty folder: every one is refused with a SceneError, or read.
#include "solidtex/pathtracer.hpp"
#include "tests/fuzz/input_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const InputFile file("scene.json");
  file.write(data, size);
  try {
    solidtex::pathtracer::load_scene(file.path());
  } catch (const solidtex::pathtracer::SceneError&) {
  }
  return 0;
}
