// What the machine leaves to this process. What cannot fit is refused before any work is done.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace solidtex::tools {

// Bytes that this process can still allocate: free memory and swap, within the limits of its
// control groups and of `ulimit -v`. Files of the system are read below `root`.
std::uint64_t available_memory(const std::filesystem::path& root = "/");

// Throws std::runtime_error, "WHAT: needs 92 TiB of memory, 20 GiB are available; REMEDY", where
// `needed` bytes are more than available_memory().
void check_memory(const std::string& what, double needed, const std::string& remedy);

// The same for the disk of `output`'s folder.
void check_disk(const std::filesystem::path& output, double needed, const std::string& remedy);

// The same for one file, which `ulimit -f` bounds.
void check_file_size(const std::filesystem::path& file, double needed, const std::string& remedy);

// "20.1 GiB"
std::string format_bytes(double bytes);

}  // namespace solidtex::tools
