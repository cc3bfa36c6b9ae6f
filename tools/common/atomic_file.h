// An output that appears complete or not at all.
#pragma once

#include <filesystem>

namespace solidtex::tools {

// Write to temporary_path(), a sibling of the target with the same extension, then commit().
// Without commit() the temporary file or folder is removed and the target stays as it was.
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path target);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  const std::filesystem::path& target() const { return target_; }
  const std::filesystem::path& temporary_path() const { return temporary_; }

  // Where temporary_path(), or a path inside it, will be in the end.
  std::filesystem::path final_path(const std::filesystem::path& path) const;

  // Replaces the target. A folder that holds something is never replaced: that is an error.
  void commit();

 private:
  std::filesystem::path target_, temporary_;
};

}  // namespace solidtex::tools
