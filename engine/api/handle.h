// What solidtex_texture is, and how calls with it fail: exceptions become codes, each thread keeps
// its first error, and the host is told.
#pragma once

#include <solidtex/solidtex.h>

#include <atomic>
#include <exception>
#include <new>
#include <optional>
#include <string>

#include "engine/api/parameters.h"
#include "engine/model/error.h"
#include "engine/texture/texture.h"

struct solidtex_texture {
  std::atomic<std::uint64_t> references = 1;
  solidtex::engine::Parameters parameters;
  solidtex_error_callback told_of_errors = nullptr;
  void* errors_user = nullptr;
  solidtex::engine::ProgressListener progress;
  std::optional<solidtex::engine::Texture> open;
  std::string path;
};

namespace solidtex::engine {

// Keeps the first error of the thread and tells the texture's host, if there is one; returns the
// status.
solidtex_status fail(const solidtex_texture* texture, solidtex_status status,
                     const char* message) noexcept;

template <class Call>
solidtex_status guarded(const solidtex_texture* texture, const Call& call) noexcept {
  try {
    call();
    return SOLIDTEX_OK;
  } catch (const Error& error) {
    return fail(texture, error.status(), error.what());
  } catch (const std::bad_alloc&) {
    return fail(texture, SOLIDTEX_OUT_OF_MEMORY, "not enough memory");
  } catch (const std::exception& error) {
    return fail(texture, SOLIDTEX_INTERNAL_ERROR, error.what());
  } catch (...) {
    return fail(texture, SOLIDTEX_INTERNAL_ERROR, "unknown exception");
  }
}

inline void require(const void* pointer, const char* message) {
  if (!pointer) throw Error(SOLIDTEX_INVALID_ARGUMENT, message);
}

}  // namespace solidtex::engine
