// What solidtex_texture is, and how calls with it fail: exceptions become codes, each thread keeps
// its first error, and the host is told.
#pragma once

#include <solidtex/solidtex.h>

#include <atomic>
#include <exception>
#include <filesystem>
#include <new>
#include <optional>
#include <string>
#include <string_view>

#include "engine/common/error.h"
#include "engine/query/texture.h"

namespace solidtex::engine {

// Parameters of a texture that is not open yet.
struct Parameters {
  std::uint64_t seed = 0, cache_limit_bytes = std::uint64_t{256} << 20, threads = 0;
  std::string precision = "full";
};

// All throw Error for a name that is not there, and list those that are; setting also for a value
// that is out of range.
void set_integer(Parameters& parameters, std::string_view name, std::uint64_t value);
void set_string(Parameters& parameters, std::string_view name, std::string_view value);
std::uint64_t get_integer(const Parameters& parameters, std::string_view name);
const std::string& get_string(const Parameters& parameters, std::string_view name);

}  // namespace solidtex::engine

struct solidtex_texture {
  std::atomic<std::uint64_t> references = 1;
  solidtex::engine::Parameters parameters;
  solidtex_error_callback error_callback = nullptr;
  void* error_user = nullptr;
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

// `model` is a path (it has a slash or ends in ".solidtex") or the bare name of a model in one of
// the model folders. Throws Error that lists the names there are and the folders searched.
std::filesystem::path find_model(const std::string& model);

// Keeps the kernels off all instruction sets better than the one that SOLIDTEX_TARGET names, if it
// is set. The first call reads it; throws where it names none that this machine has.
void limit_target();

// As Highway calls it: "AVX2".
const char* target_name();

}  // namespace solidtex::engine
