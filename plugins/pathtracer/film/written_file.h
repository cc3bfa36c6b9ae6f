// The end of writing a file.
#pragma once

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace solidtex::pathtracer {

// Throws, naming the file, when not all of it could be written: a full disk may show only here.
inline void close_written(std::ofstream& stream, const std::filesystem::path& file) {
  stream.close();
  if (!stream) {
    throw std::runtime_error(file.string() + ": cannot be written (" + std::strerror(errno) + ")");
  }
}

}  // namespace solidtex::pathtracer
