// Life of a texture: references, parameters, opening.
#include <span>

#include "engine/api/handle.h"

using namespace solidtex::engine;

namespace {

void require_closed(const solidtex_texture* texture) {
  require(texture, "texture is null");
  if (texture->open)
    throw Error(SOLIDTEX_INVALID_ARGUMENT, "texture is open already: it can be changed no more");
}

// Changes a texture that is not open yet.
template <class Call>
solidtex_status change(const solidtex_texture* texture, const Call& call) {
  return guarded(texture, [&] {
    require_closed(texture);
    call();
  });
}

void open(solidtex_texture& texture, Model model, std::string path) {
  const Parameters& chosen = texture.parameters;
  const Precision precision = chosen.precision == "fast" ? Precision::fast : Precision::full;
  texture.open.emplace(std::move(model), chosen.seed, chosen.cache_limit_bytes, precision,
                       static_cast<int>(chosen.threads), chosen.period);
  texture.path = std::move(path);
}

}  // namespace

solidtex_texture* solidtex_new(void) {
  solidtex_texture* texture = nullptr;
  guarded(nullptr, [&] { texture = new solidtex_texture; });
  return texture;
}

void solidtex_retain(solidtex_texture* texture) {
  if (texture) texture->references.fetch_add(1, std::memory_order_relaxed);
}

void solidtex_release(solidtex_texture* texture) {
  if (texture && texture->references.fetch_sub(1, std::memory_order_acq_rel) == 1) delete texture;
}

solidtex_status solidtex_set_integer(solidtex_texture* texture, const char* name, uint64_t value) {
  return change(texture, [&] {
    require(name, "name is null");
    set_integer(texture->parameters, name, value);
  });
}

solidtex_status solidtex_set_string(solidtex_texture* texture, const char* name,
                                    const char* value) {
  return change(texture, [&] {
    require(name, "name is null");
    require(value, "value is null");
    set_string(texture->parameters, name, value);
  });
}

solidtex_status solidtex_get_integer(const solidtex_texture* texture, const char* name,
                                     uint64_t* value) {
  if (value) *value = 0;
  return guarded(texture, [&] {
    require(texture, "texture is null");
    require(name, "name is null");
    require(value, "value is null");
    *value = get_integer(texture->parameters, name);
  });
}

solidtex_status solidtex_get_string(const solidtex_texture* texture, const char* name,
                                    const char** value) {
  if (value) *value = nullptr;
  return guarded(texture, [&] {
    require(texture, "texture is null");
    require(name, "name is null");
    require(value, "value is null");
    *value = get_string(texture->parameters, name).c_str();
  });
}

solidtex_status solidtex_set_error_callback(solidtex_texture* texture,
                                            solidtex_error_callback callback, void* user) {
  return change(texture, [&] {
    texture->error_callback = callback;
    texture->error_user = user;
  });
}

solidtex_status solidtex_set_progress_callback(solidtex_texture* texture,
                                               solidtex_progress_callback callback, void* user) {
  return change(texture, [&] { texture->progress = {callback, user}; });
}

solidtex_status solidtex_open(solidtex_texture* texture, const char* model) {
  return change(texture, [&] {
    require(model, "model is null");
    limit_target();
    const auto path = find_model(model);
    open(*texture, read_model(path), path.string());
  });
}

solidtex_status solidtex_open_memory(solidtex_texture* texture, const void* bytes,
                                     size_t byte_size) {
  return change(texture, [&] {
    require(bytes, "bytes is null");
    limit_target();
    const std::span data(static_cast<const std::byte*>(bytes), byte_size);
    open(*texture, parse_model(data, "model in memory"), "");
  });
}

solidtex_status solidtex_space_texture(const solidtex_space* space, const float* code,
                                       const float* colors, const char* details,
                                       solidtex_texture* texture) {
  return change(texture, [&] {
    const auto bytes = decode(space, code, colors, details);
    limit_target();
    open(*texture, parse_model(bytes, space->space.label + ", decoded"), "");
  });
}
