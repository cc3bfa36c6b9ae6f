// Errors of each thread.
#include "engine/api/handle.h"

namespace {

struct ThreadError {
  solidtex_status status = SOLIDTEX_OK;
  std::string message;
};
thread_local ThreadError thread_error;

void keep(solidtex_status status, const char* message) noexcept {
  if (thread_error.status != SOLIDTEX_OK) return;
  thread_error.status = status;
  try {
    thread_error.message = message;
  } catch (const std::bad_alloc&) {
    thread_error.message = "no memory";  // fits without allocation
  }
}

}  // namespace

solidtex_status solidtex::engine::fail(const solidtex_texture* texture, solidtex_status status,
                                       const char* message) noexcept {
  keep(status, message);
  if (texture && texture->error_callback)
    texture->error_callback(texture->error_user, status, message);
  return status;
}

const char* solidtex_error_message(void) { return thread_error.message.c_str(); }

solidtex_status solidtex_error_status(void) { return thread_error.status; }

void solidtex_clear_error(void) {
  thread_error.status = SOLIDTEX_OK;
  thread_error.message.clear();
}
