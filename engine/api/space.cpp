// C boundary of texture spaces: checks the handle and the pointers, then forwards.
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <span>
#include <vector>

#include "engine/api/handle.h"
#include "engine/common/sha256.h"
#include "engine/space/colors.h"
#include "engine/space/decode.h"
#include "engine/space/encode.h"

using namespace solidtex::engine;

namespace {

const Space& opened(const solidtex_space* space) {
  require(space, "space is null");
  return space->space;
}

// Returns a fact of a space. Otherwise sets an error and returns `otherwise`.
template <class Value, class Read>
Value fact(const solidtex_space* space, Value otherwise, const Read& read) {
  Value value = otherwise;
  guarded(nullptr, [&] { value = read(opened(space)); });
  return value;
}

const Photograph& photograph(const Space& space, std::size_t index) {
  if (index >= space.photographs.size())
    throw Error(SOLIDTEX_INVALID_ARGUMENT, "index is " + std::to_string(index) +
                                               ", expected less than " +
                                               std::to_string(space.photographs.size()));
  return space.photographs[index];
}

// Copies the material at `code` and `colors`, which may be null where the space has no colors.
Material material_at(const Space& space, const float* code, const float* colors) {
  require(code, "code is null");
  Material result{{code, code + space.code_size}, {}};
  if (!space.has_colors) return result;
  require(colors, "colors is null: materials of this space have colors");
  std::memcpy(result.colors.data(), colors, sizeof result.colors);
  return result;
}

void copy(const Space& space, const Material& material, float* code, float* colors) {
  if (code) std::ranges::copy(material.code, code);
  if (colors && space.has_colors) std::ranges::copy(material.colors, colors);
}

const Encoder& encoder(const solidtex_space& space) {
  const std::lock_guard lock(space.encoder_mutex);
  if (!space.encoder) space.encoder.emplace(space.space);
  return *space.encoder;
}

// The file appears whole or not at all, and an older one stays until then. Threads may write one.
void write_file(const std::string& path, std::span<const std::byte> bytes) {
  static std::atomic<unsigned> written = 0;
  const std::string temporary =
      path + ".tmp-" + std::to_string(getpid()) + "-" + std::to_string(++written);
  std::ofstream file(temporary, std::ios::binary | std::ios::trunc);
  const bool is_open = file.is_open();
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (file && std::rename(temporary.c_str(), path.c_str()) == 0) return;
  const std::string reason = std::strerror(errno);
  if (is_open) static_cast<void>(std::remove(temporary.c_str()));  // the first failure is told
  throw Error(SOLIDTEX_IO_ERROR, path + ": cannot write: " + reason);
}

}  // namespace

std::vector<std::byte> solidtex::engine::decode(const solidtex_space* space, const float* code,
                                                const float* colors, const char* details) {
  const Space& from = opened(space);
  return decode(from, material_at(from, code, colors), details ? details : "");
}

solidtex_space* solidtex_space_open(const char* space) {
  solidtex_space* result = nullptr;
  guarded(nullptr, [&] {
    require(space, "space is null");
    result = new solidtex_space(read_space(find_space(space)));
  });
  return result;
}

void solidtex_space_retain(solidtex_space* space) {
  if (space) space->references.fetch_add(1, std::memory_order_relaxed);
}

void solidtex_space_release(solidtex_space* space) {
  if (space && space->references.fetch_sub(1, std::memory_order_acq_rel) == 1) delete space;
}

const char* solidtex_space_name(const solidtex_space* space) {
  return fact<const char*>(space, nullptr, [](const Space& s) { return s.name.c_str(); });
}

const char* solidtex_space_path(const solidtex_space* space) {
  return fact<const char*>(space, nullptr, [](const Space& s) { return s.label.c_str(); });
}

const char* solidtex_space_sha256(const solidtex_space* space) {
  return fact<const char*>(space, nullptr, [](const Space& s) { return s.sha256.c_str(); });
}

const char* solidtex_space_metadata_json(const solidtex_space* space) {
  return fact<const char*>(space, nullptr, [](const Space& s) { return s.metadata_json.c_str(); });
}

solidtex_family solidtex_space_family(const solidtex_space* space) {
  return fact(space, SOLIDTEX_FAMILY_LATTICE, [](const Space& s) {
    if (std::holds_alternative<NoGenerator>(s.sizes)) return SOLIDTEX_FAMILY_NONE;
    return std::holds_alternative<LatticeSizes>(s.sizes) ? SOLIDTEX_FAMILY_LATTICE
                                                         : SOLIDTEX_FAMILY_SAMPLER;
  });
}

size_t solidtex_space_code_size(const solidtex_space* space) {
  return fact(space, size_t{0}, [](const Space& s) { return s.code_size; });
}

int solidtex_space_has_colors(const solidtex_space* space) {
  return fact(space, 0, [](const Space& s) { return s.has_colors ? 1 : 0; });
}

size_t solidtex_space_patch_size(const solidtex_space* space) {
  return fact(space, size_t{0}, [](const Space& s) { return static_cast<size_t>(s.patch); });
}

size_t solidtex_space_resolution(const solidtex_space* space) {
  return fact(space, size_t{0}, [](const Space& s) { return static_cast<size_t>(s.resolution); });
}

size_t solidtex_space_photograph_count(const solidtex_space* space) {
  return fact(space, size_t{0}, [](const Space& s) { return s.photographs.size(); });
}

const char* solidtex_space_photograph_name(const solidtex_space* space, size_t index) {
  return fact<const char*>(space, nullptr,
                           [&](const Space& s) { return photograph(s, index).name.c_str(); });
}

solidtex_status solidtex_space_photograph(const solidtex_space* space, size_t index, float* code,
                                          float* colors) {
  return guarded(nullptr, [&] {
    const Space& from = opened(space);
    copy(from, photograph(from, index).material, code, colors);
  });
}

solidtex_status solidtex_space_encode(const solidtex_space* space, const float* pixels,
                                      size_t width, size_t height, solidtex_patches patches,
                                      float* code, float* colors) {
  return guarded(nullptr, [&] {
    const Space& from = opened(space);
    require(pixels, "pixels is null");
    require(code, "code is null");
    if (from.has_colors) require(colors, "colors is null: materials of this space have colors");
    if (patches != SOLIDTEX_PATCHES_AVERAGE && patches != SOLIDTEX_PATCHES_MEDOID)
      throw Error(SOLIDTEX_INVALID_ARGUMENT, "patches is " + std::to_string(patches) +
                                                 ", expected a value of solidtex_patches");
    check_photograph_size(from, width, height);
    const Patches chosen = patches == SOLIDTEX_PATCHES_MEDOID ? Patches::medoid : Patches::average;
    copy(from, encode(from, encoder(*space), {pixels, 3 * width * height}, width, height, chosen),
         code, colors);
  });
}

solidtex_status solidtex_space_blend(const solidtex_space* space, size_t count,
                                     const double* weights, const float* codes, const float* colors,
                                     float* code, float* blended_colors) {
  return guarded(nullptr, [&] {
    const Space& from = opened(space);
    if (count == 0) throw Error(SOLIDTEX_INVALID_ARGUMENT, "count is 0, expected 1 or more");
    require(weights, "weights is null");
    require(codes, "codes is null");
    require(code, "code is null");
    if (from.has_colors) {
      require(colors, "colors is null: materials of this space have colors");
      require(blended_colors, "blended_colors is null: materials of this space have colors");
    }
    std::vector<Material> materials;
    for (std::size_t k = 0; k < count; ++k)
      materials.push_back(material_at(from, codes + k * from.code_size,
                                      colors ? colors + k * std::tuple_size_v<Colors> : nullptr));
    copy(from, blend(from, materials, {weights, count}), code, blended_colors);
  });
}

solidtex_status solidtex_space_write_model(const solidtex_space* space, const float* code,
                                           const float* colors, const char* details,
                                           const char* path) {
  return guarded(nullptr, [&] {
    require(path, "path is null");
    const auto bytes = decode(space, code, colors, details);
    parse_model(bytes, std::string(path));  // refuses what could not be opened
    write_file(path, bytes);
  });
}

solidtex_status solidtex_file_sha256(const char* path, char digest[65]) {
  return guarded(nullptr, [&] {
    require(path, "path is null");
    require(digest, "digest is null");
    std::strcpy(digest, file_sha256(path).c_str());
  });
}
