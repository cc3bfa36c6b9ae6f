// Child processes and their temporary files.
#pragma once

#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

namespace solidtex::tools {

struct ChildUsage {
  double wall_seconds = 0, cpu_seconds = 0;
  std::uint64_t peak_resident_bytes = 0;
};

// Runs a program and discards its standard output. Throws if the program fails. After Ctrl-C it
// stops the program and throws Interrupted.
ChildUsage run_child(const std::vector<std::string>& command);

// Returns the path of a program in the folder of this one.
std::filesystem::path sibling_program(const std::string& name);

// File name that is unique to this process; the destructor removes the file.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& extension)
      : path_(std::filesystem::temp_directory_path() /
              ("solidtex-bench-" + std::to_string(getpid()) + extension)) {}
  ~TemporaryFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace solidtex::tools
