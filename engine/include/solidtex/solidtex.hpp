// Header-only C++ wrapper over solidtex.h: RAII, exceptions, spans. See solidtex.h for all meaning.
#pragma once

#include <solidtex/solidtex.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace solidtex {

// A failed call: what() is the engine's message, status() its code.
class error : public std::runtime_error {
 public:
  error(solidtex_status status, const std::string& message)
      : std::runtime_error(message), status_(status) {}
  solidtex_status status() const { return status_; }

 private:
  solidtex_status status_;
};

inline std::string version() { return solidtex_version(); }

// The instruction set in use, see solidtex_target.
inline std::string target() {
  solidtex_clear_error();
  const char* name = solidtex_target();
  if (!name) throw error(solidtex_error_status(), solidtex_error_message());
  return name;
}

struct options {
  std::uint64_t seed = 0;
  std::uint64_t cache_limit_bytes = 256ull << 20;
  solidtex_precision precision = SOLIDTEX_PRECISION_FULL;
};

// An open model. Movable; queries are const and may run on any number of threads.
class texture {
 public:
  // `model`: a path, or the bare name of a shipped model.
  explicit texture(const std::string& model, options chosen = {}) {
    const solidtex_options c_options = to_c(chosen);
    solidtex_texture* opened = nullptr;
    check([&] { return solidtex_open(model.c_str(), &c_options, &opened); });
    handle_.reset(opened);
  }

  static texture from_memory(std::span<const std::byte> bytes, options chosen = {}) {
    const solidtex_options c_options = to_c(chosen);
    solidtex_texture* opened = nullptr;
    check([&] { return solidtex_open_memory(bytes.data(), bytes.size(), &c_options, &opened); });
    return texture(opened);
  }

  solidtex_family family() const { return solidtex_get_family(handle_.get()); }
  std::size_t channel_count() const { return solidtex_channel_count(handle_.get()); }
  std::string channel_name(std::size_t channel) const {
    return text(solidtex_channel_name(handle_.get(), channel));
  }
  std::string color_space() const { return text(solidtex_color_space(handle_.get())); }
  std::string name() const { return text(solidtex_name(handle_.get())); }
  std::string path() const { return text(solidtex_path(handle_.get())); }
  std::uint64_t seed() const { return solidtex_get_seed(handle_.get()); }
  solidtex_precision precision() const { return solidtex_get_precision(handle_.get()); }
  std::string metadata_json() const { return text(solidtex_metadata_json(handle_.get())); }
  std::uint64_t parameter_count() const { return solidtex_parameter_count(handle_.get()); }

  // points: n x 3 floats relative to origin. values: n x channel_count() floats. gradients, where
  // wanted: n x channel_count() x 3 floats, derivatives by x, y and z.
  void eval_points(const std::array<double, 3>& origin, std::span<const float> points,
                   std::span<float> values, std::span<float> gradients = {}) const {
    const std::size_t count = points.size() / 3;
    require(points.size() % 3 == 0, "eval_points: points must hold n x 3 floats");
    require_answers(count, values, gradients);
    check([&] {
      return solidtex_eval_points(handle_.get(), origin.data(), points.data(), count, values.data(),
                                  gradients.data());
    });
  }

  // The same, each averaged over a cube whose edge is twice its radius: n radii, 0 or more.
  void eval_filtered(const std::array<double, 3>& origin, std::span<const float> points,
                     std::span<const float> radii, std::span<float> values,
                     std::span<float> gradients = {}) const {
    const std::size_t count = radii.size();
    require(points.size() == 3 * count, "eval_filtered: points must hold n x 3 floats and radii n");
    require_answers(count, values, gradients);
    check([&] {
      return solidtex_eval_filtered(handle_.get(), origin.data(), points.data(), radii.data(),
                                    count, values.data(), gradients.data());
    });
  }

  // The same over parallelepipeds: n x 9 floats, three half-edges for each point.
  void eval_footprints(const std::array<double, 3>& origin, std::span<const float> points,
                       std::span<const float> axes, std::span<float> values,
                       std::span<float> gradients = {}) const {
    const std::size_t count = points.size() / 3;
    require(points.size() == 3 * count && axes.size() == 9 * count,
            "eval_footprints: points must hold n x 3 floats and axes n x 9");
    require_answers(count, values, gradients);
    check([&] {
      return solidtex_eval_footprints(handle_.get(), origin.data(), points.data(), axes.data(),
                                      count, values.data(), gradients.data());
    });
  }

  // Voxels [origin, origin + size), index order [x][y][z][channel].
  void eval_box(const std::array<std::int64_t, 3>& origin, const std::array<std::int64_t, 3>& size,
                std::span<float> values) const {
    require(size[0] >= 0 && size[1] >= 0 && size[2] >= 0 &&
                values.size() == static_cast<std::size_t>(size[0]) *
                                     static_cast<std::size_t>(size[1]) *
                                     static_cast<std::size_t>(size[2]) * channel_count(),
            "eval_box: values must hold size[0] x size[1] x size[2] x channels floats");
    check([&] {
      return solidtex_eval_box(handle_.get(), origin.data(), size.data(), values.data());
    });
  }

  solidtex_cache_stats cache_stats() const {
    solidtex_cache_stats stats{};
    stats.struct_size = sizeof stats;
    check([&] { return solidtex_get_cache_stats(handle_.get(), &stats); });
    return stats;
  }

  const solidtex_texture* handle() const { return handle_.get(); }

 private:
  explicit texture(solidtex_texture* opened) : handle_(opened) {}

  static solidtex_options to_c(const options& chosen) {
    solidtex_options result;
    solidtex_options_init(&result);
    result.seed = chosen.seed;
    result.cache_limit_bytes = chosen.cache_limit_bytes;
    result.precision = chosen.precision;
    return result;
  }

  static std::string text(const char* found) { return found ? found : ""; }

  static void require(bool condition, const char* message) {
    if (!condition) throw error(SOLIDTEX_INVALID_ARGUMENT, message);
  }

  void require_answers(std::size_t count, std::span<float> values,
                       std::span<float> gradients) const {
    const std::size_t size = count * channel_count();
    require(values.size() == size, "values must hold n x channels floats");
    require(gradients.empty() || gradients.size() == 3 * size,
            "gradients must hold n x channels x 3 floats");
  }

  template <class Call>
  static void check(Call call) {
    solidtex_clear_error();
    const solidtex_status status = call();
    if (status != SOLIDTEX_OK) throw error(status, solidtex_error_message());
  }

  struct closer {
    void operator()(solidtex_texture* handle) const { solidtex_close(handle); }
  };
  std::unique_ptr<solidtex_texture, closer> handle_;
};

}  // namespace solidtex
