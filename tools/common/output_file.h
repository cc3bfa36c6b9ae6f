// Output files: files appear complete or not at all, and every failed write throws.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace solidtex::tools {

// "FILE: cannot write: REASON"
class WriteError : public std::runtime_error {
 public:
  WriteError(const std::filesystem::path& path, const std::string& reason)
      : std::runtime_error(path.string() + ": cannot write: " + reason) {}
};

// Write to temporary_path(), a sibling of the target with the same extension, then commit().
// Without commit() the temporary file or folder is removed and the target stays as it was.
class AtomicFile {
 public:
  // Throws WriteError if nothing can be written beside the target.
  explicit AtomicFile(const std::filesystem::path& target);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  const std::filesystem::path& target() const { return target_; }
  const std::filesystem::path& temporary_path() const { return temporary_; }

  // Replaces the target. Throws for a folder that is not empty, and for a file that was not there
  // when this began: another process has written it.
  void commit();

 private:
  std::filesystem::path target_, temporary_;
  bool replaces_;
};

// Calls `write` with a temporary name, which becomes the target's when it returns. Error messages
// name the target instead of the temporary name.
void write_completely(const std::filesystem::path& target,
                      const std::function<void(const std::filesystem::path&)>& write);

// Removes temporary files of the target that a killed process has left. Returns false if a running
// process holds one.
bool remove_abandoned(const std::filesystem::path& target);

// File with writes at any offset. Throws WriteError.
class OutputFile {
 public:
  // Errors name `shown`, or the path itself.
  explicit OutputFile(const std::filesystem::path& path, const std::filesystem::path& shown = {});
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(std::uint64_t offset, const void* bytes, std::size_t count);

  // Waits until the disk has the bytes.
  void sync();

  // Some file systems report a failed write only here.
  void close();

 private:
  [[noreturn]] void fail() const;

  std::filesystem::path shown_;
  int file_;
};

// Waits until the disk has the names in the folder.
void sync_folder(const std::filesystem::path& folder);

// Makes the folders of a path that are missing. Throws WriteError.
void make_folders(const std::filesystem::path& path);

// Throws WriteError if `path` cannot be created: no folder, no permission, a read-only disk.
void check_writable(const std::filesystem::path& path);

// Throws if `path` exists, unless `force`.
void refuse_overwrite(const std::filesystem::path& path, bool force);

// Throws if `output` is the file of an input, even with `force`; if it exists, unless `force`; and
// if it cannot be created.
void check_output(const std::filesystem::path& output,
                  const std::vector<std::filesystem::path>& inputs, bool force);

// Whether the name of a sequence's files has a place for their number: a run of #.
bool has_number(const std::filesystem::path& path);

// Replaces a run of # in the name by the number, zero-padded to the length of the run.
std::filesystem::path numbered(const std::filesystem::path& path, int number);

// Returns the extension in lower case: ".png" of "a.PNG".
std::string lower_extension(const std::filesystem::path& path);

}  // namespace solidtex::tools
