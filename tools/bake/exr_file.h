// An EXR image that is written band by band, so that it need not fit into memory.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace solidtex::tools {

// 32-bit float channels of the given names. Every write that fails throws WriteError.
class ExrFile {
 public:
  ExrFile(const std::filesystem::path& path, int width, int height,
          const std::vector<std::string>& names);
  ~ExrFile();

  // The next rows from the top: values [y][x][channel].
  void write_rows(const float* values, int count);

  // After the last row.
  void close();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace solidtex::tools
