// What a long bake has finished, kept in a file, so that it can go on after Ctrl-C or a crash.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>

namespace solidtex::tools {

// A line of what the file is, one of JSON that says which bake it belongs to, then parts in the
// order in which they are baked: values, and a fingerprint of them, which tells whole ones.
class Checkpoint {
 public:
  Checkpoint() = default;  // keeps nothing

  // Goes on from the file if it is there. `identity` is what must be the same for the same bits;
  // throws std::runtime_error, which says what is different, for that of another bake.
  Checkpoint(const std::filesystem::path& file, const nlohmann::ordered_json& identity);

  // The next part; false where it is not there whole, and from then on.
  bool read(std::span<float> values);

  // Adds a part behind those read. Throws std::runtime_error.
  void append(std::span<const float> values);

 private:
  std::filesystem::path file_;
  std::fstream stream_;  // open where there is a file
  std::streamoff end_ = 0;
  bool is_at_end_ = false;
};

}  // namespace solidtex::tools
