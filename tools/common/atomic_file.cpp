#include "tools/common/atomic_file.h"

#include <unistd.h>

#include <stdexcept>
#include <string>

namespace solidtex::tools {
namespace {

namespace fs = std::filesystem;

// "out/slices/" names the folder "out/slices".
fs::path without_trailing_slash(const fs::path& path) {
  return path.has_filename() ? path : path.parent_path();
}

fs::path temporary_sibling(const fs::path& target) {
  fs::path name = ".";
  name += target.stem();
  name += ".";
  name += std::to_string(getpid());
  name += ".tmp";
  name += target.extension();
  return target.parent_path() / name;
}

}  // namespace

AtomicFile::AtomicFile(fs::path target)
    : target_(without_trailing_slash(target)), temporary_(temporary_sibling(target_)) {
  const fs::path folder = target_.parent_path();
  if (!folder.empty() && !fs::is_directory(folder))
    throw std::runtime_error(target_.string() + ": cannot write: there is no folder " +
                             folder.string());
  fs::remove_all(temporary_);
}

AtomicFile::~AtomicFile() {
  std::error_code ignored;
  fs::remove_all(temporary_, ignored);
}

fs::path AtomicFile::final_path(const fs::path& path) const {
  const fs::path inside = path.lexically_relative(temporary_);
  return inside == "." ? target_ : target_ / inside;
}

void AtomicFile::commit() {
  std::error_code problem;
  fs::rename(temporary_, target_, problem);
  if (problem)
    throw std::runtime_error(target_.string() + ": cannot be replaced: " + problem.message());
}

}  // namespace solidtex::tools
