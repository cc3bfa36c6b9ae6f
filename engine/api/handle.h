// The C handle and its errors: exceptions become statuses, each thread keeps its first error, and
// the error callback runs.
#pragma once

#include <solidtex/solidtex.h>

#include <atomic>
#include <exception>
#include <filesystem>
#include <mutex>
#include <new>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "engine/common/error.h"
#include "engine/common/parallel.h"
#include "engine/query/texture.h"
#include "engine/space/encoder.h"
#include "engine/space/space.h"

namespace solidtex::engine {

// Parameters of a texture.
struct Parameters {
  std::uint64_t seed = 0, cache_limit_bytes = std::uint64_t{256} << 20, threads = 0, period = 0;
  std::string precision = "full";
};

// Access by name. An unknown name throws Error that lists the known ones; so does a value out of
// range.
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

struct solidtex_space {
  explicit solidtex_space(solidtex::engine::Space read) : space(std::move(read)) {}

  std::atomic<std::uint64_t> references = 1;
  const solidtex::engine::Space space;

  // The encoder is made when it is first needed. A failure is tried again.
  mutable std::mutex encoder_mutex;
  mutable std::optional<solidtex::engine::Encoder> encoder;
};

namespace solidtex::engine {

// Keeps the first error of the thread and calls the texture's error callback. Returns the status.
solidtex_status fail(const solidtex_texture* texture, solidtex_status status,
                     const char* message) noexcept;

// Runs a call of the C interface in the default floating-point environment. An exception becomes a
// status.
template <class Call>
solidtex_status guarded(const solidtex_texture* texture, const Call& call) noexcept {
  try {
    const DefaultFloatMode mode;
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

// Returns the path of a model. `model` is a path if it has a slash or ends in ".solidtex",
// otherwise a bare name in one of the model folders. Throws Error that lists the known names and
// the folders.
std::filesystem::path find_model(const std::string& model);

// Returns the bare names of the models in all model folders.
std::set<std::string> model_names();

// Returns the path of a texture space in the same way; its ending is ".solidtex-space".
std::filesystem::path find_space(const std::string& space);

// Returns the bytes of the model file of a code. Checks the pointers. `colors` may be null where
// the space has none, `details` always.
std::vector<std::byte> decode(const solidtex_space* space, const float* code, const float* colors,
                              const char* details);

// Restricts kernels to the instruction set that SOLIDTEX_TARGET names. The first call reads the
// variable. Throws if the machine lacks that instruction set.
void limit_target();

// Returns Highway's name of the instruction set in use, such as "AVX2".
const char* target_name();

}  // namespace solidtex::engine
