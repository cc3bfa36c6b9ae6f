// Preloaded library: the N-th call that changes the disk fails, or is the last before a power cut.
//   SOLIDTEX_FAULT_CALL    N; without it the calls are only counted
//   SOLIDTEX_FAULT_ACTION  a number: errno of the call and of all later ones; "kill": SIGKILL;
//                          "power": what is not synchronized is lost, then SIGKILL
//   SOLIDTEX_FAULT_COUNT   file for the number of calls
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

enum { MAX_FILES = 256 };
static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static long calls = 0;
static int dirty[MAX_FILES];  // by descriptor: bytes are not synchronized
static char renamed_from[MAX_FILES][PATH_MAX], renamed_to[MAX_FILES][PATH_MAX];
static int renames = 0;  // that are not synchronized
static char unsafe[MAX_FILES][PATH_MAX];  // closed files whose bytes are not synchronized
static int unsafes = 0;

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

static void cut_power(void) {
  for (int file = 0; file < MAX_FILES; ++file)
    if (dirty[file] && ftruncate(file, 0) != 0) abort();
  while (renames-- > 0)
    if (REAL(rename)(renamed_to[renames], renamed_from[renames]) != 0) abort();
  while (unsafes-- > 0)  // those whose renaming was undone are temporary files again
    if (truncate(unsafe[unsafes], 0) != 0 && errno != ENOENT) abort();
}

// Returns the error of this call, or 0.
static int fault(void) {
  const char *call = getenv("SOLIDTEX_FAULT_CALL"), *action = getenv("SOLIDTEX_FAULT_ACTION");
  ++calls;
  if (!call || calls < atol(call)) return 0;
  if (atoi(action) > 0) return atoi(action);
  if (strcmp(action, "power") == 0) cut_power();
  kill(getpid(), SIGKILL);
  pause();
  return 0;
}

#define FAIL_OR(statements) \
  pthread_mutex_lock(&mutex);           \
  const int error = fault();            \
  if (!error) {                         \
    statements;                         \
  }                                     \
  pthread_mutex_unlock(&mutex);         \
  if (error) {                          \
    errno = error;                      \
    return -1;                          \
  }

ssize_t pwrite(int file, const void *bytes, size_t count, off_t offset) {
  FAIL_OR(if (file < MAX_FILES) dirty[file] = 1)
  return REAL(pwrite)(file, bytes, count, offset);
}

ssize_t pwrite64(int file, const void *bytes, size_t count, off64_t offset) {
  FAIL_OR(if (file < MAX_FILES) dirty[file] = 1)
  return REAL(pwrite64)(file, bytes, count, offset);
}

int fsync(int file) {
  struct stat status;
  FAIL_OR(if (fstat(file, &status) == 0 && S_ISDIR(status.st_mode)) renames = 0;
          else if (file < MAX_FILES) dirty[file] = 0)
  return REAL(fsync)(file);
}

int rename(const char *from, const char *to) {
  FAIL_OR()
  char path[PATH_MAX] = "";
  if (!realpath(from, path)) return -1;
  const int result = REAL(rename)(from, to);
  for (int i = 0; i < unsafes; ++i)
    if (strcmp(unsafe[i], path) == 0 && !realpath(to, unsafe[i])) abort();
  if (result == 0 && renames < MAX_FILES) {
    strncpy(renamed_from[renames], from, PATH_MAX - 1);
    strncpy(renamed_to[renames++], to, PATH_MAX - 1);
  }
  return result;
}

int mkdir(const char *path, mode_t mode) {
  FAIL_OR()
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

static int open_file(const char *path, int flags, mode_t mode) {
  if (flags & O_CREAT) {
    FAIL_OR()
  }
  return REAL(open)(path, flags, mode);
}

int open(const char *path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const mode_t mode = flags & O_CREAT ? va_arg(more, mode_t) : 0;
  va_end(more);
  return open_file(path, flags, mode);
}

int open64(const char *path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const mode_t mode = flags & O_CREAT ? va_arg(more, mode_t) : 0;
  va_end(more);
  return open_file(path, flags, mode);
}

__attribute__((destructor)) static void report(void) {
  const char *name = getenv("SOLIDTEX_FAULT_COUNT");
  FILE *file = name ? fopen(name, "w") : NULL;
  if (!file) return;
  fprintf(file, "%ld", calls);
  fclose(file);
}
