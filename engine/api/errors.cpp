// Errors of each thread.
#include <algorithm>
#include <cstring>

#include "engine/api/handle.h"

namespace {

// It has no destructor: the C library ends a process that lacks the memory to register one.
struct ThreadError {
  solidtex_status status = SOLIDTEX_OK;
  char message[4096] = "";
};
thread_local ThreadError thread_error;

void keep(solidtex_status status, const char* message) noexcept {
  if (thread_error.status != SOLIDTEX_OK) return;
  thread_error.status = status;
  const std::size_t size = std::min(std::strlen(message), sizeof thread_error.message - 1);
  std::memcpy(thread_error.message, message, size);
  thread_error.message[size] = 0;
}

}  // namespace

solidtex_status solidtex::engine::fail(const solidtex_texture* texture, solidtex_status status,
                                       const char* message) noexcept {
  keep(status, message);
  if (texture && texture->error_callback)
    texture->error_callback(texture->error_user, status, message);
  return status;
}

const char* solidtex_error_message(void) { return thread_error.message; }

solidtex_status solidtex_error_status(void) { return thread_error.status; }

void solidtex_clear_error(void) {
  thread_error.status = SOLIDTEX_OK;
  thread_error.message[0] = 0;
}
