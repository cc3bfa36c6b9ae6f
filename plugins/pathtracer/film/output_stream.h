// Checked end of writing a file.
#pragma once

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace solidtex::pathtracer {

// Throws, naming the file, if it was not written completely. A full disk may show only here.
inline void close_or_throw(std::ofstream& stream, const std::filesystem::path& file) {
  stream.close();
  if (!stream) {
    throw std::runtime_error(file.string() + ": cannot be written (" + std::strerror(errno) + ")");
  }
}

}  // namespace solidtex::pathtracer
