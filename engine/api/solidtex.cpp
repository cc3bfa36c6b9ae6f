// C boundary of facts and queries: checks the handle and the pointers, then forwards.
#include <solidtex/solidtex.h>

#include <algorithm>
#include <cstring>
#include <string>

#include "engine/api/handle.h"

using namespace solidtex::engine;

namespace {

constexpr double kZero[3] = {0, 0, 0};
constexpr std::size_t kMaxStructSize = 1024;  // larger ones are garbage

const Texture& opened(const solidtex_texture* texture) {
  require(texture, "texture is null");
  if (!texture->open) throw Error(SOLIDTEX_INVALID_ARGUMENT, "texture is not open");
  return *texture->open;
}

// Returns a fact of an open texture. Otherwise sets an error and returns `otherwise`.
template <class Value, class Read>
Value fact(const solidtex_texture* texture, Value otherwise, const Read& read) {
  Value value = otherwise;
  guarded(texture, [&] { value = read(opened(texture)); });
  return value;
}

// Reads a struct of a host that was compiled with any version of the header. Members that the host
// lacks are zero. Members that this library lacks must be zero.
template <class Struct>
Struct read_struct(const Struct& given, const std::string& name) {
  constexpr std::size_t known = sizeof(Struct), word = sizeof(std::size_t);
  const std::size_t size = given.struct_size;
  const std::string found =
      name + ".struct_size is " + std::to_string(size) + ", expected " + std::to_string(known);
  if (size < 2 * word || size % word != 0 || size > kMaxStructSize)
    throw Error(SOLIDTEX_INVALID_ARGUMENT, found + ", sizeof(" + name + ")");
  const auto* bytes = reinterpret_cast<const unsigned char*>(&given);
  if (size > known && std::any_of(bytes + known, bytes + size, [](unsigned char b) { return b; }))
    throw Error(SOLIDTEX_INVALID_ARGUMENT,
                found + ": this library, version " SOLIDTEX_VERSION_STRING
                        ", needs zeros in the members that it does not know");
  Struct result{};
  std::memcpy(&result, &given, std::min(size, known));
  return result;
}

// Runs a query of an open texture and reports its progress to the host.
template <class Run>
solidtex_status query(const solidtex_texture* texture, const solidtex_token* token,
                      const Run& run) {
  return guarded(texture, [&] {
    const Texture& opened_texture = opened(texture);
    ProgressListener listener = texture->progress;
    if (token) {
      thread_local std::uint64_t queries = 0;
      const solidtex_token given = read_struct(*token, "solidtex_token");
      listener.token_callback = given.progress_callback;
      listener.token_user = given.user;
      if (given.progress_callback) listener.query = ++queries;
    }
    const ProgressScope progress(listener);
    run(opened_texture);
  });
}

Footprints read_footprints(const solidtex_footprints& given) {
  const solidtex_footprints read = read_struct(given, "solidtex_footprints");
  if (!read.radii && !read.axes)
    throw Error(SOLIDTEX_INVALID_ARGUMENT,
                "solidtex_footprints: radii is null and axes is null, expected one of them; points "
                "without footprints need a null footprints");
  if (read.radii && read.axes)
    throw Error(SOLIDTEX_INVALID_ARGUMENT,
                "solidtex_footprints: radii and axes are set, expected one of them");
  return {read.radii, read.axes};
}

}  // namespace

const char* solidtex_version(void) { return SOLIDTEX_VERSION_STRING; }

const char* solidtex_target(void) {
  const char* name = nullptr;
  guarded(nullptr, [&] {
    limit_target();
    name = target_name();
  });
  return name;
}

const char* solidtex_model_names(void) {
  static thread_local std::string lines;
  const char* result = nullptr;
  guarded(nullptr, [&] {
    lines.clear();
    for (const std::string& name : model_names()) lines += name + '\n';
    result = lines.c_str();
  });
  return result;
}

solidtex_family solidtex_get_family(const solidtex_texture* texture) {
  return fact(texture, SOLIDTEX_FAMILY_LATTICE, [](const Texture& t) {
    return std::holds_alternative<LatticeModel>(t.model().architecture) ? SOLIDTEX_FAMILY_LATTICE
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

solidtex_status solidtex_eval(const solidtex_texture* texture, const double* origin,
                              const float* points, const solidtex_footprints* footprints,
                              size_t count, float* values, float* jacobians) {
  return solidtex_eval_with_token(texture, origin, points, footprints, count, values, jacobians,
                                  nullptr);
}

solidtex_status solidtex_eval_with_token(const solidtex_texture* texture, const double* origin,
                                         const float* points, const solidtex_footprints* footprints,
                                         size_t count, float* values, float* jacobians,
                                         const solidtex_token* token) {
  return query(texture, token, [&](const Texture& t) {
    if (count == 0) return;
    require(points, "points is null");
    const Footprints given = footprints ? read_footprints(*footprints) : Footprints{};
    require(values, "values is null");
    t.eval(origin ? origin : kZero, points, given, count, {values, jacobians});
  });
}

solidtex_status solidtex_eval_box(const solidtex_texture* texture, const int64_t origin[3],
                                  const int64_t size[3], float* values) {
  return solidtex_eval_box_with_token(texture, origin, size, values, nullptr);
}

solidtex_status solidtex_eval_box_with_token(const solidtex_texture* texture,
                                             const int64_t origin[3], const int64_t size[3],
                                             float* values, const solidtex_token* token) {
  return query(texture, token, [&](const Texture& t) {
    require(origin, "origin is null");
    require(size, "size is null");
    const bool empty = size[0] == 0 || size[1] == 0 || size[2] == 0;
    if (!empty) require(values, "values is null");
    t.eval_box(origin, size, values);
  });
}

solidtex_status solidtex_get_statistics(const solidtex_texture* texture,
                                        solidtex_statistics* statistics) {
  return guarded(texture, [&] {
    const Texture& opened_texture = opened(texture);
    require(statistics, "statistics is null");
    solidtex_statistics found = read_struct(*statistics, "solidtex_statistics");
    const auto cache = opened_texture.cache_stats();
    const auto counts = opened_texture.query_counts();
    found.point_count = counts.points;
    found.voxel_count = counts.voxels;
    found.hit_count = cache.hit_count;
    found.miss_count = cache.miss_count;
    found.brick_count = cache.brick_count;
    found.brick_nanoseconds = cache.brick_nanoseconds;
    found.resident_bytes = cache.resident_bytes;
    found.peak_bytes = cache.peak_bytes;
    found.scratch_bytes = opened_texture.scratch().bytes();
    found.peak_scratch_bytes = opened_texture.scratch().peak();
    std::memcpy(statistics, &found, std::min(found.struct_size, sizeof found));
  });
}

// Symbols for hosts that were compiled when these were no inline functions.
extern "C" {

SOLIDTEX_API solidtex_status solidtex_eval_points(const solidtex_texture* texture,
                                                  const double* origin, const float* points,
                                                  size_t count, float* values, float* jacobians) {
  return solidtex_eval(texture, origin, points, nullptr, count, values, jacobians);
}

SOLIDTEX_API solidtex_status solidtex_eval_filtered(const solidtex_texture* texture,
                                                    const double* origin, const float* points,
                                                    const float* radii, size_t count, float* values,
                                                    float* jacobians) {
  const solidtex_footprints footprints{sizeof(solidtex_footprints), radii, nullptr};
  return solidtex_eval(texture, origin, points, &footprints, count, values, jacobians);
}

SOLIDTEX_API solidtex_status solidtex_eval_footprints(const solidtex_texture* texture,
                                                      const double* origin, const float* points,
                                                      const float* axes, size_t count,
                                                      float* values, float* jacobians) {
  const solidtex_footprints footprints{sizeof(solidtex_footprints), nullptr, axes};
  return solidtex_eval(texture, origin, points, &footprints, count, values, jacobians);
}

}  // extern "C"
