#include "tools/common/output_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <vector>

namespace solidtex::tools {
namespace {

namespace fs = std::filesystem;

// "out/slices/" names the folder "out/slices".
fs::path without_trailing_slash(const fs::path& path) {
  return path.has_filename() ? path : path.parent_path();
}

// File systems take 255 bytes a name; the rest of the name needs some of them.
constexpr std::size_t max_stem = 200;

std::string temporary_prefix(const fs::path& target) {
  std::string prefix = ".";
  prefix += target.stem().string().substr(0, max_stem);
  return prefix += ".";
}

std::string temporary_suffix(const fs::path& target) {
  return ".tmp" + target.extension().string();
}

// "HOST-": machines that share a disk may have processes of the same number.
std::string process_prefix() {
  std::array<char, 33> host{};
  gethostname(host.data(), host.size() - 1);
  return std::string(host.data()) + "-";
}

// Start of a process in clock ticks since the machine's; empty where /proc does not tell.
std::string start_time(pid_t process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/stat");
  std::string text;
  std::getline(file, text);
  const std::size_t name_end = text.rfind(')');  // the name may hold blanks
  if (name_end == std::string::npos) return "";
  std::istringstream fields(text.substr(name_end + 1));
  constexpr int place = 20;  // after the name
  for (int i = 0; i < place; ++i) fields >> text;
  return text;
}

fs::path temporary_sibling(const fs::path& target) {
  return target.parent_path() /
         (temporary_prefix(target) + process_prefix() + std::to_string(getpid()) + "-" +
          start_time(getpid()) + temporary_suffix(target));
}

// Tells whether the process "NUMBER-START" runs; another one may have its number by now.
bool is_alive(const std::string& process) {
  char* end = nullptr;
  const pid_t number = static_cast<pid_t>(std::strtol(process.c_str(), &end, 10));
  if (number <= 0) return true;
  if (kill(number, 0) != 0 && errno == ESRCH) return false;
  return *end != '-' || end + 1 == start_time(number);
}

// Processes hold a lock on their temporary files while they live.
bool is_held(const fs::path& temporary) {
  const int file = open(temporary.c_str(), O_RDONLY);
  const bool held = file >= 0 && flock(file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  if (file >= 0) ::close(file);
  return held;
}

// Returns the temporary files of a target whose names go on with `process`.
std::vector<fs::path> temporaries(const fs::path& target, const std::string& process) {
  const std::string prefix = temporary_prefix(target) + process, suffix = temporary_suffix(target);
  const fs::path folder = target.parent_path();
  std::vector<fs::path> found;
  std::error_code ignored;
  for (const fs::directory_entry& entry :
       fs::directory_iterator(folder.empty() ? "." : folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(prefix) && name.ends_with(suffix)) found.push_back(folder / name);
  }
  return found;
}

// Removes temporary files and folders that killed processes of this machine have left.
void remove_remains(const fs::path& target) {
  const std::string process = process_prefix();
  std::error_code ignored;
  for (const fs::path& temporary : temporaries(target, process)) {
    const std::string name = temporary.filename().string();
    const std::size_t begin = temporary_prefix(target).size() + process.size();
    const std::size_t end = name.size() - temporary_suffix(target).size();
    if (!is_alive(name.substr(begin, end - begin)) && !is_held(temporary))
      fs::remove_all(temporary, ignored);
  }
}

}  // namespace

AtomicFile::AtomicFile(const fs::path& target)
    : target_(without_trailing_slash(target)), temporary_(temporary_sibling(target_)) {
  const fs::path folder = target_.parent_path();
  std::error_code ignored;
  if (!folder.empty() && !fs::is_directory(folder, ignored))
    throw WriteError(target_, "there is no folder " + folder.string());
  replaces_ = fs::exists(fs::symlink_status(target_, ignored));
  fs::remove_all(temporary_, ignored);
  remove_remains(target_);
  // Permissions alone do not tell: the file system may be read-only, or full.
  const int probe = open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL, 0666);
  if (probe < 0) throw WriteError(target_, std::strerror(errno));
  ::close(probe);
  fs::remove(temporary_, ignored);
}

AtomicFile::~AtomicFile() {
  std::error_code ignored;
  fs::remove_all(temporary_, ignored);
}

void AtomicFile::commit() {
  if (!replaces_) {
    const int result =
        renameat2(AT_FDCWD, temporary_.c_str(), AT_FDCWD, target_.c_str(), RENAME_NOREPLACE);
    if (result == 0) return;
    if (errno == EEXIST)
      throw std::runtime_error(target_.string() +
                               ": another program has written it meanwhile, and it stays: choose "
                               "another name, or --force");
    const bool is_unknown = errno == EINVAL || errno == ENOSYS;  // to some file systems
    if (!is_unknown) throw WriteError(target_, std::strerror(errno));
  }
  std::error_code problem;
  fs::rename(temporary_, target_, problem);
  if (problem)
    throw std::runtime_error(target_.string() + ": cannot be replaced: " + problem.message());
}

void write_completely(const fs::path& target, const std::function<void(const fs::path&)>& write) {
  AtomicFile file(target);
  try {
    write(file.temporary_path());
  } catch (const std::exception& error) {
    const std::string temporary = file.temporary_path().string();
    std::string message = error.what();
    const std::size_t place = message.find(temporary);
    if (place == std::string::npos) throw;
    throw std::runtime_error(message.replace(place, temporary.size(), file.target().string()));
  }
  file.commit();
}

bool remove_abandoned(const fs::path& target) {
  bool all = true;
  std::error_code ignored;
  for (const fs::path& temporary : temporaries(target, "")) {
    if (is_held(temporary))
      all = false;
    else
      fs::remove(temporary, ignored);
  }
  return all;
}

OutputFile::OutputFile(const fs::path& path, const fs::path& shown)
    : shown_(shown.empty() ? path : shown),
      file_(open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666)) {
  if (file_ < 0) fail();
  flock(file_, LOCK_EX | LOCK_NB);  // for remove_abandoned(); some file systems have no locks
}

OutputFile::~OutputFile() {
  if (file_ >= 0) ::close(file_);
}

void OutputFile::write(std::uint64_t offset, const void* bytes, std::size_t count) {
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

void OutputFile::sync() {
  if (fsync(file_) != 0) fail();
}

void OutputFile::close() {
  const int file = file_;
  file_ = -1;
  if (::close(file) != 0) fail();
}

void OutputFile::fail() const { throw WriteError(shown_, std::strerror(errno)); }

void sync_folder(const fs::path& folder) {
  const int file = open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY);
  const bool failed = file < 0 || fsync(file) != 0;
  const int reason = errno;
  if (file >= 0) ::close(file);
  if (failed) throw WriteError(folder, std::strerror(reason));
}

void make_folders(const fs::path& path) {
  std::error_code problem;
  fs::create_directories(path, problem);
  if (problem) throw WriteError(path, problem.message());
}

void check_writable(const fs::path& path) { const AtomicFile probe(path); }

void refuse_overwrite(const fs::path& path, bool force) {
  std::error_code ignored;  // what cannot be looked at cannot be written either
  if (fs::is_directory(path, ignored)) {
    throw std::runtime_error(
        path.string() + ": exists already as a folder, which is never replaced: give another name");
  }
  if (!force && fs::exists(fs::symlink_status(path, ignored)))
    throw std::runtime_error(path.string() + ": exists already (--force overwrites it)");
}

void check_output(const fs::path& output, const std::vector<fs::path>& inputs, bool force) {
  std::error_code ignored;  // a file that is not there
  for (const fs::path& input : inputs)
    if (fs::equivalent(output, input, ignored))
      throw std::runtime_error("-o " + output.string() + ": found the file of the input " +
                               input.string() + ", which is never replaced, expected another name");
  refuse_overwrite(output, force);
  check_writable(output);
}

bool has_number(const fs::path& path) {
  return path.filename().string().find('#') != std::string::npos;
}

fs::path numbered(const fs::path& path, int number) {
  std::string name = path.filename().string(), digits = std::to_string(number);
  const std::size_t start = name.find('#');
  const std::size_t length = std::min(name.find_first_not_of('#', start), name.size()) - start;
  if (digits.size() < length) digits.insert(0, length - digits.size(), '0');
  name.replace(start, length, digits);
  return path.parent_path() / name;
}

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char letter) { return std::tolower(letter); });
  return extension;
}

}  // namespace solidtex::tools
