// SHA-256 (FIPS 180-4), the name of a file's contents.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

namespace solidtex::engine {

// Returns the digest as 64 lower-case hexadecimal digits.
std::string sha256(std::span<const std::byte> bytes);

// Returns the digest of a file of any size. Throws Error if it cannot be read.
std::string file_sha256(const std::filesystem::path& path);

}  // namespace solidtex::engine
