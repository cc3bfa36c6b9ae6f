// Checkpoint of a long bake, to continue after Ctrl-C or a crash.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>

namespace solidtex::tools {

// Format: a line with the file type, a line of JSON with the identity of the bake, then the parts
// in the order of baking. A part is its values and their hash, which detects incomplete parts.
class Checkpoint {
 public:
  Checkpoint() = default;  // saves nothing

  // Continues from the file if it exists. `identity` holds the settings that the bits depend on.
  // Throws std::runtime_error with the difference when the file has another identity.
  Checkpoint(const std::filesystem::path& file, const nlohmann::ordered_json& identity);

  // Reads the next part. Returns false from the first part on that is missing or damaged.
  bool read(std::span<float> values);

  // Writes a part behind those read. Throws WriteError.
  void append(std::span<const float> values);

 private:
  std::filesystem::path file_;
  std::fstream stream_;  // open if there is a file
  std::streamoff end_ = 0;
  bool is_at_end_ = false;
};

}  // namespace solidtex::tools
