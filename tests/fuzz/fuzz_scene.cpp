// Scene files, alone in an empty folder: every one is refused with a SceneError, or read.
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "solidtex/pathtracer.hpp"

namespace {

// A folder of this process, in memory where the system has such a file system.
class Folder {
 public:
  Folder() {
    namespace fs = std::filesystem;
    const fs::path memory = "/dev/shm";
    const fs::path parent = fs::is_directory(memory) ? memory : fs::temp_directory_path();
    path_ = parent / ("solidtex-fuzz-" + std::to_string(getpid()));
    fs::create_directory(path_);
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  std::filesystem::path scene() const { return path_ / "scene.json"; }

 private:
  std::filesystem::path path_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Folder folder;
  {
    std::ofstream file(folder.scene(), std::ios::binary);
    file.write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  }
  try {
    solidtex::pathtracer::load_scene(folder.scene());
  } catch (const solidtex::pathtracer::SceneError&) {
  }
  return 0;
}
