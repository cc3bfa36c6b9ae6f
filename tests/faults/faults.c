// Preloaded library: the N-th call that changes the disk fails, or is the last before a power cut.
//   SOLIDTEX_FAULT_CALL    N; without it the calls are only counted
//   SOLIDTEX_FAULT_ACTION  a number: errno of the call and of all later ones; "kill": SIGKILL;
//                          "power": what is not synchronized is lost, then SIGKILL
//   SOLIDTEX_FAULT_ONCE    if set, calls after the N-th succeed
//   SOLIDTEX_FAULT_FOLDER  only files below it are counted (default: all regular files)
//   SOLIDTEX_FAULT_COUNT   file for the number of calls
//   SOLIDTEX_FAULT_LOG     file for the name of the call that failed
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

enum { MAX_FILES = 256 };
static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static long calls = 0;
static bool over = false;     // the fault has happened, and is not to happen again
static int dirty[MAX_FILES];  // by descriptor: bytes are not synchronized
static char renamed_from[MAX_FILES][PATH_MAX], renamed_to[MAX_FILES][PATH_MAX];
static int renames = 0;  // that are not synchronized
static char unsafe[MAX_FILES][PATH_MAX];  // closed files whose bytes are not synchronized
static int unsafes = 0;

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

static void cut_power(void) {
  for (int file = 0; file < MAX_FILES; ++file)
    if (dirty[file] && REAL(ftruncate)(file, 0) != 0) abort();
  while (renames-- > 0)
    if (REAL(rename)(renamed_to[renames], renamed_from[renames]) != 0) abort();
  while (unsafes-- > 0)  // those whose renaming was undone are temporary files again
    if (truncate(unsafe[unsafes], 0) != 0 && errno != ENOENT) abort();
}

static void write_text(const char *variable, const char *format, ...) {
  const char *name = getenv(variable);
  const int file = name ? REAL(open)(name, O_WRONLY | O_CREAT | O_TRUNC, 0666) : -1;
  if (file < 0) return;
  char text[PATH_MAX + 64];
  va_list more;
  va_start(more, format);
  const int length = vsnprintf(text, sizeof text, format, more);
  va_end(more);
  if (REAL(write)(file, text, (size_t)length) != length) abort();
  REAL(close)(file);
}

// Returns the error of this call, or 0.
static int fault(const char *name) {
  const char *call = getenv("SOLIDTEX_FAULT_CALL"), *action = getenv("SOLIDTEX_FAULT_ACTION");
  ++calls;
  if (!call || over || calls < atol(call)) return 0;
  if (calls == atol(call)) write_text("SOLIDTEX_FAULT_LOG", "%s", name);
  over = getenv("SOLIDTEX_FAULT_ONCE") != NULL;
  if (atoi(action) > 0) return atoi(action);
  if (strcmp(action, "power") == 0) cut_power();
  kill(getpid(), SIGKILL);
  pause();
  return 0;
}

// Of the folder itself, too.
static bool is_below_folder(const char *path) {
  const char *folder = getenv("SOLIDTEX_FAULT_FOLDER");
  const size_t length = folder ? strlen(folder) : 0;
  return !folder || (strncmp(path, folder, length) == 0 && strchr("/", path[length]));
}

// Of a name that need not exist yet.
static bool counts_path(int folder, const char *path) {
  char whole[PATH_MAX] = "", link[64];
  if (!getenv("SOLIDTEX_FAULT_FOLDER") || path[0] == '/') return is_below_folder(path);
  snprintf(link, sizeof link, "/proc/self/fd/%d", folder);
  if (folder == AT_FDCWD ? !getcwd(whole, sizeof whole)
                         : readlink(link, whole, sizeof whole - 1) < 0)
    return false;
  return is_below_folder(whole);
}

static bool counts_file(int file) {
  struct stat status;
  char link[64], path[PATH_MAX] = "";
  if (file < 0 || fstat(file, &status) != 0) return false;
  if (!S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode)) return false;
  snprintf(link, sizeof link, "/proc/self/fd/%d", file);
  return readlink(link, path, sizeof path - 1) > 0 && is_below_folder(path);
}

static bool counts_stream(FILE *stream) {
  const int file = fileno(stream);
  return counts_file(file) && (fcntl(file, F_GETFL) & O_ACCMODE) != O_RDONLY;
}

// If `counts`, counts the call `name`, which fails with `failure` or runs the statements.
#define FAIL_OR(name, counts, failure, statements) \
  if (counts) {                                    \
    pthread_mutex_lock(&mutex);                    \
    const int error = fault(name);                 \
    if (!error) {                                  \
      statements;                                  \
    }                                              \
    pthread_mutex_unlock(&mutex);                  \
    if (error) {                                   \
      errno = error;                               \
      return failure;                              \
    }                                              \
  }

#define FAIL_WRITE(name) \
  FAIL_OR(name, counts_file(file), -1, if (file < MAX_FILES) dirty[file] = 1)

ssize_t write(int file, const void *bytes, size_t count) {
  FAIL_WRITE("write")
  return REAL(write)(file, bytes, count);
}

ssize_t writev(int file, const struct iovec *parts, int count) {
  FAIL_WRITE("writev")
  return REAL(writev)(file, parts, count);
}

ssize_t pwrite(int file, const void *bytes, size_t count, off_t offset) {
  FAIL_WRITE("pwrite")
  return REAL(pwrite)(file, bytes, count, offset);
}

ssize_t pwrite64(int file, const void *bytes, size_t count, off64_t offset) {
  FAIL_WRITE("pwrite64")
  return REAL(pwrite64)(file, bytes, count, offset);
}

ssize_t sendfile(int file, int from, off_t *offset, size_t count) {
  FAIL_WRITE("sendfile")
  return REAL(sendfile)(file, from, offset, count);
}

ssize_t sendfile64(int file, int from, off64_t *offset, size_t count) {
  FAIL_WRITE("sendfile64")
  return REAL(sendfile64)(file, from, offset, count);
}

ssize_t copy_file_range(int from, off64_t *from_offset, int file, off64_t *offset, size_t count,
                        unsigned flags) {
  FAIL_WRITE("copy_file_range")
  return REAL(copy_file_range)(from, from_offset, file, offset, count, flags);
}

int ftruncate(int file, off_t length) {
  FAIL_WRITE("ftruncate")
  return REAL(ftruncate)(file, length);
}

int ftruncate64(int file, off64_t length) {
  FAIL_WRITE("ftruncate64")
  return REAL(ftruncate64)(file, length);
}

// These return their error.
int posix_fallocate(int file, off_t offset, off_t length) {
  FAIL_OR("posix_fallocate", counts_file(file), error, )
  return REAL(posix_fallocate)(file, offset, length);
}

int posix_fallocate64(int file, off64_t offset, off64_t length) {
  FAIL_OR("posix_fallocate64", counts_file(file), error, )
  return REAL(posix_fallocate64)(file, offset, length);
}

static int is_synchronized(int file) {
  struct stat status;
  if (fstat(file, &status) == 0 && S_ISDIR(status.st_mode)) renames = 0;
  else if (file < MAX_FILES) dirty[file] = 0;
  return 0;
}

int fsync(int file) {
  FAIL_OR("fsync", counts_file(file), -1, is_synchronized(file))
  return REAL(fsync)(file);
}

int fdatasync(int file) {
  FAIL_OR("fdatasync", counts_file(file), -1, is_synchronized(file))
  return REAL(fdatasync)(file);
}

// A stream that failed says so, as its flag of the C library does.
static size_t fail_stream(FILE *stream, const char *name) {
  FAIL_OR(name, counts_stream(stream), (stream->_flags |= 0x20, 1), )
  return 0;
}

size_t fwrite(const void *bytes, size_t size, size_t count, FILE *stream) {
  return fail_stream(stream, "fwrite") ? 0 : REAL(fwrite)(bytes, size, count, stream);
}

int fputs(const char *text, FILE *stream) {
  return fail_stream(stream, "fputs") ? EOF : REAL(fputs)(text, stream);
}

int fputc(int letter, FILE *stream) {
  return fail_stream(stream, "fputc") ? EOF : REAL(fputc)(letter, stream);
}

int fflush(FILE *stream) {
  return stream && fail_stream(stream, "fflush") ? EOF : REAL(fflush)(stream);
}

int fclose(FILE *stream) {
  const size_t failed = fail_stream(stream, "fclose");
  const int error = errno, result = REAL(fclose)(stream);
  if (failed) errno = error;
  return failed ? EOF : result;
}

// Names of the working folder alone.
int renameat2(int from_at, const char *from, int to_at, const char *to, unsigned flags) {
  if (from_at != AT_FDCWD || to_at != AT_FDCWD) abort();
  FAIL_OR("rename", counts_path(AT_FDCWD, to), -1, )
  char path[PATH_MAX] = "";
  if (!realpath(from, path)) return -1;
  const int result = REAL(renameat2)(from_at, from, to_at, to, flags);
  for (int i = 0; i < unsafes; ++i)
    if (strcmp(unsafe[i], path) == 0 && !realpath(to, unsafe[i])) abort();
  if (result == 0 && renames < MAX_FILES) {
    strncpy(renamed_from[renames], from, PATH_MAX - 1);
    strncpy(renamed_to[renames++], to, PATH_MAX - 1);
  }
  return result;
}

int rename(const char *from, const char *to) {
  return renameat2(AT_FDCWD, from, AT_FDCWD, to, 0);
}

int mkdir(const char *path, mode_t mode) {
  FAIL_OR("mkdir", counts_path(AT_FDCWD, path), -1, )
  return REAL(mkdir)(path, mode);
}

int close(int file) {
  if (file >= 0 && file < MAX_FILES && dirty[file]) {
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    const ssize_t length = unsafes < MAX_FILES ? readlink(link, unsafe[unsafes], PATH_MAX - 1) : 0;
    if (length > 0) unsafe[unsafes++][length] = 0;
    dirty[file] = 0;
  }
  return REAL(close)(file);
}

// Files that may be written.
static bool counts_open(int folder, const char *path, int flags) {
  return (flags & O_ACCMODE) != O_RDONLY && counts_path(folder, path);
}

#define MODE                                                                    \
  va_list more;                                                                 \
  va_start(more, flags);                                                        \
  const mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(more, mode_t) : 0; \
  va_end(more);

int open(const char *path, int flags, ...) {
  MODE
  FAIL_OR("open", counts_open(AT_FDCWD, path, flags), -1, )
  return REAL(open)(path, flags, mode);
}

int open64(const char *path, int flags, ...) {
  MODE
  FAIL_OR("open64", counts_open(AT_FDCWD, path, flags), -1, )
  return REAL(open64)(path, flags, mode);
}

int openat(int folder, const char *path, int flags, ...) {
  MODE
  FAIL_OR("openat", counts_open(folder, path, flags), -1, )
  return REAL(openat)(folder, path, flags, mode);
}

int openat64(int folder, const char *path, int flags, ...) {
  MODE
  FAIL_OR("openat64", counts_open(folder, path, flags), -1, )
  return REAL(openat64)(folder, path, flags, mode);
}

static bool counts_fopen(const char *path, const char *mode) {
  return strpbrk(mode, "wa+") && counts_path(AT_FDCWD, path);
}

FILE *fopen(const char *path, const char *mode) {
  FAIL_OR("fopen", counts_fopen(path, mode), NULL, )
  return REAL(fopen)(path, mode);
}

FILE *fopen64(const char *path, const char *mode) {
  FAIL_OR("fopen64", counts_fopen(path, mode), NULL, )
  return REAL(fopen64)(path, mode);
}

__attribute__((destructor)) static void report(void) {
  write_text("SOLIDTEX_FAULT_COUNT", "%ld", calls);
}
