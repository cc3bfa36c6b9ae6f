// A file where every failure to write is an exception with its reason.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace solidtex::tools {

// The path is kept apart: what is written to under a temporary name is shown by its final one.
class WriteError : public std::runtime_error {
 public:
  WriteError(std::filesystem::path path, const std::string& reason)
      : std::runtime_error("cannot write: " + reason), path_(std::move(path)) {}
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path path)
      : path_(std::move(path)), file_(open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666)) {
    if (file_ < 0) fail();
  }
  ~OutputFile() {
    if (file_ >= 0) ::close(file_);
  }
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(std::uint64_t offset, const void* bytes, std::size_t count) {
    const auto* from = static_cast<const char*>(bytes);
    while (count > 0) {
      const ssize_t written = pwrite(file_, from, count, static_cast<off_t>(offset));
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) fail();
      from += written;
      offset += static_cast<std::uint64_t>(written);
      count -= static_cast<std::size_t>(written);
    }
  }

  // Some file systems report a failure only here.
  void close() {
    const int file = file_;
    file_ = -1;
    if (::close(file) != 0) fail();
  }

 private:
  [[noreturn]] void fail() const { throw WriteError(path_, std::strerror(errno)); }

  std::filesystem::path path_;
  int file_;
};

}  // namespace solidtex::tools
