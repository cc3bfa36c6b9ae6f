#include "tools/common/limits.h"

#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <limits>
#include <optional>
#include <stdexcept>

namespace solidtex::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t unlimited = std::numeric_limits<std::uint64_t>::max();

// Nothing where the file does not begin with a number ("max").
std::optional<std::uint64_t> number_in(const fs::path& file) {
  std::uint64_t value = 0;
  std::ifstream stream(file);
  return stream >> value ? std::optional(value) : std::nullopt;
}

// The number behind a word: "MemAvailable:   21556424 kB". 0 where the word is missing.
std::uint64_t number_behind(const fs::path& file, const std::string& word) {
  std::ifstream stream(file);
  std::string found;
  std::uint64_t value = 0;
  while (stream >> found)
    if (found == word && stream >> value) return value;
  return 0;
}

std::uint64_t difference(std::uint64_t limit, std::uint64_t used) {
  return limit > used ? limit - used : 0;
}

std::uint64_t machine_memory(const fs::path& root) {
  const fs::path file = root / "proc/meminfo";
  const std::uint64_t free =
      number_behind(file, "MemAvailable:") + number_behind(file, "SwapFree:");
  return free ? 1024 * free : unlimited;
}

// Names of the same things in the two versions of control groups.
struct GroupFiles {
  const char *limit, *used, *inactive, *active;
};
constexpr GroupFiles version_1{"memory.limit_in_bytes", "memory.usage_in_bytes",
                               "total_inactive_file", "total_active_file"};
constexpr GroupFiles version_2{"memory.max", "memory.current", "inactive_file", "active_file"};

// What one group leaves. Pages of files count as used, but the system takes them back.
std::uint64_t left_in(const fs::path& folder, const GroupFiles& names) {
  const auto limit = number_in(folder / names.limit);
  const auto used = number_in(folder / names.used);
  if (!limit || !used) return unlimited;
  const fs::path details = folder / "memory.stat";
  const std::uint64_t files =
      number_behind(details, names.inactive) + number_behind(details, names.active);
  return difference(*limit, difference(*used, files));
}

// A group and all that it lies in; "0::/user.slice" or "4:memory:/docker/1f" in /proc/self/cgroup.
std::uint64_t left_in_groups(const fs::path& root) {
  std::uint64_t left = unlimited;
  std::ifstream stream(root / "proc/self/cgroup");
  for (std::string line; std::getline(stream, line);) {
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    if (!controllers.empty() && controllers != "memory") continue;
    const GroupFiles& names = controllers.empty() ? version_2 : version_1;
    const fs::path top = root / "sys/fs/cgroup" / controllers;
    for (fs::path group = line.substr(second + 1);; group = group.parent_path()) {
      left = std::min(left, left_in(top / group.relative_path(), names));
      if (group == group.parent_path()) break;
    }
  }
  return left;
}

// `ulimit -v` counts what is mapped, used or not.
std::uint64_t left_of_address_space(const fs::path& root) {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return unlimited;
  return difference(limit.rlim_cur, 1024 * number_behind(root / "proc/self/status", "VmSize:"));
}

// Infinity where there is no disk: writing will tell.
double free_on_disk(const fs::path& output) {
  std::error_code unknown;
  const fs::space_info disk = fs::space(fs::absolute(output).parent_path(), unknown);
  if (unknown || disk.capacity == 0) return std::numeric_limits<double>::infinity();
  return static_cast<double>(disk.available);
}

[[noreturn]] void refuse(const std::string& what, double needed, const std::string& of_what,
                         const std::string& found, const std::string& remedy,
                         Need need = Need::exact) {
  const char* bound = need == Need::at_least ? "at least " : "";
  throw std::runtime_error(what + ": needs " + bound + format_bytes(needed) + of_what + ", " +
                           found + (remedy.empty() ? "" : "; " + remedy));
}

}  // namespace

std::uint64_t available_memory(const fs::path& root) {
  return std::min({machine_memory(root), left_in_groups(root), left_of_address_space(root)});
}

void check_memory(const std::string& what, double needed, const std::string& remedy) {
  const auto available = static_cast<double>(available_memory());
  if (needed > available)
    refuse(what, needed, " of memory", format_bytes(available) + " are available", remedy);
}

void check_disk(const fs::path& output, double needed, const std::string& remedy, Need need) {
  const double free = free_on_disk(output);
  if (needed > free)
    refuse(output.string(), needed, " on the disk", format_bytes(free) + " are free there", remedy,
           need);
}

void warn_of_disk(const fs::path& output, double most, const std::string& consequence) {
  const double free = free_on_disk(output);
  if (most <= free) return;
  std::cerr << output.string() << ": takes up to " << format_bytes(most) << " on the disk, "
            << format_bytes(free) << " are free there; " << consequence << "\n";
}

void check_file_size(const fs::path& file, double needed, const std::string& remedy, Need need) {
  rlimit limit{};
  if (getrlimit(RLIMIT_FSIZE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return;
  const auto allowed = static_cast<double>(limit.rlim_cur);
  if (needed > allowed)
    refuse(file.string(), needed, " in one file",
           format_bytes(allowed) + " are allowed (ulimit -f)", remedy, need);
}

std::string format_bytes(double bytes) {
  constexpr std::array units{"bytes", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB"};
  std::size_t unit = 0;
  for (; bytes >= 1024 && unit + 1 < units.size(); ++unit) bytes /= 1024;
  char text[32];
  std::snprintf(text, sizeof text, unit ? "%.1f %s" : "%.0f %s", bytes, units[unit]);
  return text;
}

}  // namespace solidtex::tools
