// The C boundary: check the handle and the pointers, forward, turn exceptions into codes. No logic.
#include <solidtex/solidtex.h>

#include <exception>
#include <new>
#include <string>
#include <utility>

#include "engine/api/find_model.h"
#include "engine/api/target.h"
#include "engine/model/error.h"
#include "engine/texture/interrupt.h"
#include "engine/texture/texture.h"

using solidtex::engine::Error;
using solidtex::engine::Model;
using solidtex::engine::Precision;
using solidtex::engine::Texture;

struct solidtex_texture {
  Texture texture;
  std::string path;
};

namespace {

constexpr std::uint64_t kDefaultCacheLimit = std::uint64_t{256} << 20;

struct ThreadError {
  solidtex_status status = SOLIDTEX_OK;
  std::string message;
};
thread_local ThreadError thread_error;

// Keeps the first error; returns the one of this call.
solidtex_status fail(solidtex_status status, const char* message) noexcept {
  if (thread_error.status != SOLIDTEX_OK) return status;
  thread_error.status = status;
  try {
    thread_error.message = message;
  } catch (const std::bad_alloc&) {
    thread_error.message = "no memory";  // short enough to need none
  }
  return status;
}

template <class Call>
solidtex_status guarded(const Call& call) noexcept {
  try {
    call();
    return SOLIDTEX_OK;
  } catch (const Error& error) {
    return fail(error.status(), error.what());
  } catch (const std::bad_alloc&) {
    return fail(SOLIDTEX_OUT_OF_MEMORY, "not enough memory");
  } catch (const std::exception& error) {
    return fail(SOLIDTEX_INTERNAL_ERROR, error.what());
  } catch (...) {
    return fail(SOLIDTEX_INTERNAL_ERROR, "unknown exception");
  }
}

void require(const void* pointer, const char* message) {
  if (!pointer) throw Error(SOLIDTEX_INVALID_ARGUMENT, message);
}

void require_size(std::size_t found, std::size_t expected, const char* type) {
  if (found == expected) return;
  throw Error(SOLIDTEX_INVALID_ARGUMENT, std::string(type) + ".struct_size is " +
                                             std::to_string(found) + ", expected " +
                                             std::to_string(expected));
}

solidtex_options checked(const solidtex_options* options) {
  solidtex_options result;
  solidtex_options_init(&result);
  if (!options) return result;
  require_size(options->struct_size, sizeof(solidtex_options), "solidtex_options");
  return *options;
}

Precision checked(solidtex_precision precision) {
  switch (static_cast<int>(precision)) {
    case SOLIDTEX_PRECISION_FULL:
      return Precision::full;
    case SOLIDTEX_PRECISION_FAST:
      return Precision::fast;
    default:
      throw Error(SOLIDTEX_INVALID_ARGUMENT,
                  "solidtex_options.precision is " + std::to_string(static_cast<int>(precision)) +
                      ", expected SOLIDTEX_PRECISION_FULL (0) or SOLIDTEX_PRECISION_FAST (1)");
  }
}

solidtex_texture* make_texture(Model model, const solidtex_options& options, std::string path) {
  return new solidtex_texture{Texture(std::move(model), options.seed, options.cache_limit_bytes,
                                      checked(options.precision)),
                              std::move(path)};
}

// A fact of the texture, or `otherwise` and an error when the handle is null.
template <class Value, class Read>
Value fact(const solidtex_texture* texture, Value otherwise, const Read& read) {
  Value value = otherwise;
  guarded([&] {
    require(texture, "texture is null");
    value = read(texture->texture);
  });
  return value;
}

}  // namespace

const char* solidtex_version(void) { return SOLIDTEX_VERSION_STRING; }

const char* solidtex_target(void) {
  const char* name = nullptr;
  guarded([&] {
    solidtex::engine::limit_target();
    name = solidtex::engine::target_name();
  });
  return name;
}

const char* solidtex_error_message(void) { return thread_error.message.c_str(); }

solidtex_status solidtex_error_status(void) { return thread_error.status; }

void solidtex_clear_error(void) {
  thread_error.status = SOLIDTEX_OK;
  thread_error.message.clear();
}

void solidtex_options_init(solidtex_options* options) {
  if (options)
    *options = {sizeof(solidtex_options), 0, kDefaultCacheLimit, SOLIDTEX_PRECISION_FULL};
}

solidtex_status solidtex_open(const char* model, const solidtex_options* options,
                              solidtex_texture** texture) {
  if (texture) *texture = nullptr;
  return guarded([&] {
    require(model, "model is null");
    require(texture, "texture is null");
    const solidtex_options chosen = checked(options);
    solidtex::engine::limit_target();
    const auto path = solidtex::engine::find_model(model);
    *texture = make_texture(solidtex::engine::read_model(path), chosen, path.string());
  });
}

solidtex_status solidtex_open_memory(const void* bytes, size_t byte_size,
                                     const solidtex_options* options, solidtex_texture** texture) {
  if (texture) *texture = nullptr;
  return guarded([&] {
    require(bytes, "bytes is null");
    require(texture, "texture is null");
    const solidtex_options chosen = checked(options);
    solidtex::engine::limit_target();
    const std::span data(static_cast<const std::byte*>(bytes), byte_size);
    *texture = make_texture(solidtex::engine::parse_model(data, "model in memory"), chosen, "");
  });
}

void solidtex_close(solidtex_texture* texture) { delete texture; }

solidtex_family solidtex_get_family(const solidtex_texture* texture) {
  return fact(texture, SOLIDTEX_FAMILY_FIELD, [](const Texture& t) {
    return std::holds_alternative<solidtex::engine::FieldModel>(t.model().architecture)
               ? SOLIDTEX_FAMILY_FIELD
               : SOLIDTEX_FAMILY_SAMPLER;
  });
}

size_t solidtex_channel_count(const solidtex_texture* texture) {
  return fact(texture, size_t{0}, [](const Texture& t) { return t.model().channels.size(); });
}

const char* solidtex_channel_name(const solidtex_texture* texture, size_t channel) {
  return fact<const char*>(texture, nullptr, [&](const Texture& t) {
    const auto& channels = t.model().channels;
    if (channel >= channels.size()) {
      throw Error(SOLIDTEX_INVALID_ARGUMENT, "channel is " + std::to_string(channel) +
                                                 ", expected less than " +
                                                 std::to_string(channels.size()));
    }
    return channels[channel].c_str();
  });
}

const char* solidtex_color_space(const solidtex_texture* texture) {
  return fact<const char*>(texture, nullptr,
                           [](const Texture& t) { return t.model().color_space.c_str(); });
}

const char* solidtex_name(const solidtex_texture* texture) {
  return fact<const char*>(texture, nullptr,
                           [](const Texture& t) { return t.model().name.c_str(); });
}

uint64_t solidtex_get_seed(const solidtex_texture* texture) {
  return fact(texture, uint64_t{0}, [](const Texture& t) { return t.seed(); });
}

solidtex_precision solidtex_get_precision(const solidtex_texture* texture) {
  return fact(texture, SOLIDTEX_PRECISION_FULL, [](const Texture& t) {
    return t.precision() == Precision::fast ? SOLIDTEX_PRECISION_FAST : SOLIDTEX_PRECISION_FULL;
  });
}

const char* solidtex_metadata_json(const solidtex_texture* texture) {
  return fact<const char*>(texture, nullptr,
                           [](const Texture& t) { return t.model().metadata_json.c_str(); });
}

uint64_t solidtex_parameter_count(const solidtex_texture* texture) {
  return fact(texture, uint64_t{0}, [](const Texture& t) { return t.model().parameter_count; });
}

const char* solidtex_path(const solidtex_texture* texture) {
  return fact<const char*>(texture, nullptr, [&](const Texture&) { return texture->path.c_str(); });
}

solidtex_status solidtex_eval_points(const solidtex_texture* texture, const double* origin,
                                     const float* points, size_t count, float* values,
                                     float* gradients) {
  return guarded([&] {
    require(texture, "texture is null");
    if (count == 0) return;
    require(points, "points is null");
    require(values, "values is null");
    const double zero[3] = {0, 0, 0};
    texture->texture.eval_points(origin ? origin : zero, points, count, {values, gradients});
  });
}

solidtex_status solidtex_eval_filtered(const solidtex_texture* texture, const double* origin,
                                       const float* points, const float* radii, size_t count,
                                       float* values, float* gradients) {
  return guarded([&] {
    require(texture, "texture is null");
    if (count == 0) return;
    require(points, "points is null");
    require(radii, "radii is null");
    require(values, "values is null");
    const double zero[3] = {0, 0, 0};
    texture->texture.eval_filtered(origin ? origin : zero, points, radii, count,
                                   {values, gradients});
  });
}

solidtex_status solidtex_eval_footprints(const solidtex_texture* texture, const double* origin,
                                         const float* points, const float* axes, size_t count,
                                         float* values, float* gradients) {
  return guarded([&] {
    require(texture, "texture is null");
    if (count == 0) return;
    require(points, "points is null");
    require(axes, "axes is null");
    require(values, "values is null");
    const double zero[3] = {0, 0, 0};
    texture->texture.eval_footprints(origin ? origin : zero, points, axes, count,
                                     {values, gradients});
  });
}

solidtex_status solidtex_eval_box(const solidtex_texture* texture, const int64_t origin[3],
                                  const int64_t size[3], float* values) {
  return guarded([&] {
    require(texture, "texture is null");
    require(origin, "origin is null");
    require(size, "size is null");
    const bool empty = size[0] == 0 || size[1] == 0 || size[2] == 0;
    if (!empty) require(values, "values is null");
    texture->texture.eval_box(origin, size, values);
  });
}

void solidtex_set_interrupt(solidtex_interrupt ask, void* user) {
  solidtex::engine::question_of_this_thread() = {ask, user, {}};
}

solidtex_status solidtex_get_cache_stats(const solidtex_texture* texture,
                                         solidtex_cache_stats* stats) {
  return guarded([&] {
    require(texture, "texture is null");
    require(stats, "stats is null");
    require_size(stats->struct_size, sizeof(solidtex_cache_stats), "solidtex_cache_stats");
    const auto found = texture->texture.cache_stats();
    *stats = {sizeof(solidtex_cache_stats), found.hit_count,  found.miss_count,
              found.resident_bytes,         found.peak_bytes, found.brick_count};
  });
}
