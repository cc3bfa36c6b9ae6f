// Limits of memory and disk. Tools check them before any work is done.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace solidtex::tools {

// Returns the bytes that this process can still allocate: free memory and swap, within the limits
// of its control groups and of `ulimit -v`. Reads the system's files below `root`.
std::uint64_t available_memory(const std::filesystem::path& root = "/");

// Throws std::runtime_error, "WHAT: needs 92 TiB of memory, 20 GiB are available; REMEDY", if
// `needed` bytes exceed available_memory().
void check_memory(const std::string& what, double needed, const std::string& remedy);

// Whether an output takes the bytes that are needed, or these and more, as compressed ones do.
enum class Need { exact, at_least };

// Checks the disk of `output`'s folder in the same way.
void check_disk(const std::filesystem::path& output, double needed, const std::string& remedy,
                Need need = Need::exact);

// Says on stderr "OUTPUT: takes up to 4.0 GiB on the disk, 3.0 GiB are free there; CONSEQUENCE" if
// the disk of its folder has less than `most` bytes: how much a compressed output takes is not
// known before it is made.
void warn_of_disk(const std::filesystem::path& output, double most, const std::string& consequence);

// Checks the limit of `ulimit -f` on one file in the same way.
void check_file_size(const std::filesystem::path& file, double needed, const std::string& remedy,
                     Need need = Need::exact);

// "20.1 GiB"
std::string format_bytes(double bytes);

}  // namespace solidtex::tools
