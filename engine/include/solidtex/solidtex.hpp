// Header-only C++ wrapper over solidtex.h: RAII, exceptions, spans. See solidtex.h for all meaning.
#pragma once

#include <solidtex/solidtex.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
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

// The parameters of solidtex_set_integer and solidtex_set_string, and who hears of progress.
struct options {
  std::uint64_t seed = 0;
  std::uint64_t cache_limit_bytes = 256ull << 20;
  std::string precision = "full";
  std::uint64_t threads = 0;
  // How much of a query is done, from 0 to 1; false stops it. It throws nothing, and runs on the
  // thread that queries: several at once where several threads do.
  std::function<bool(double done)> progress = {};
};

// An open model. Copies share it; queries are const and may run on any number of threads.
class texture {
 public:
  // `model`: a path, or the bare name of a shipped model.
  explicit texture(const std::string& model, options chosen = {}) : texture(std::move(chosen)) {
    check([&] { return solidtex_open(made_->handle, model.c_str()); });
  }

  static texture from_memory(std::span<const std::byte> bytes, options chosen = {}) {
    texture opened(std::move(chosen));
    check([&] { return solidtex_open_memory(opened.made_->handle, bytes.data(), bytes.size()); });
    return opened;
  }

  solidtex_family family() const { return solidtex_get_family(handle()); }
  std::size_t channel_count() const { return solidtex_channel_count(handle()); }
  std::string channel_name(std::size_t channel) const {
    return text(solidtex_channel_name(handle(), channel));
  }
  std::string color_space() const { return text(solidtex_color_space(handle())); }
  std::string name() const { return text(solidtex_name(handle())); }
  std::string path() const { return text(solidtex_path(handle())); }
  std::uint64_t seed() const { return integer("seed"); }
  std::string precision() const {
    const char* found = nullptr;
    check([&] { return solidtex_get_string(handle(), "precision", &found); });
    return found;
  }
  std::string metadata_json() const { return text(solidtex_metadata_json(handle())); }
  std::uint64_t parameter_count() const { return solidtex_parameter_count(handle()); }

  // points: n x 3 floats relative to origin. values: n x channel_count() floats. gradients, where
  // wanted: n x channel_count() x 3 floats, derivatives by x, y and z.
  void eval_points(const std::array<double, 3>& origin, std::span<const float> points,
                   std::span<float> values, std::span<float> gradients = {}) const {
    const std::size_t count = points.size() / 3;
    require(points.size() % 3 == 0, "eval_points: points must hold n x 3 floats");
    require_answers(count, values, gradients);
    check([&] {
      return solidtex_eval_points(handle(), origin.data(), points.data(), count, values.data(),
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
      return solidtex_eval_filtered(handle(), origin.data(), points.data(), radii.data(), count,
                                    values.data(), gradients.data());
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
      return solidtex_eval_footprints(handle(), origin.data(), points.data(), axes.data(), count,
                                      values.data(), gradients.data());
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
    check([&] { return solidtex_eval_box(handle(), origin.data(), size.data(), values.data()); });
  }

  solidtex_statistics statistics() const {
    solidtex_statistics found{};
    found.struct_size = sizeof found;
    check([&] { return solidtex_get_statistics(handle(), &found); });
    return found;
  }

  // Lives as long as this or a copy of it.
  const solidtex_texture* handle() const { return made_ ? made_->handle : nullptr; }

 private:
  // What the callback of the handle reads lives as long as the handle.
  struct made {
    explicit made(options chosen) : progress(std::move(chosen.progress)) {}
    made(const made&) = delete;
    made& operator=(const made&) = delete;
    ~made() { solidtex_release(handle); }

    std::function<bool(double)> progress;
    solidtex_texture* handle = solidtex_new();
  };

  explicit texture(options chosen) : made_(std::make_shared<made>(chosen)) {
    if (!made_->handle) throw error(SOLIDTEX_OUT_OF_MEMORY, "not enough memory");
    set("seed", chosen.seed);
    set("cache_limit_bytes", chosen.cache_limit_bytes);
    set("threads", chosen.threads);
    check(
        [&] { return solidtex_set_string(made_->handle, "precision", chosen.precision.c_str()); });
    if (!made_->progress) return;
    const auto go_on = [](void* user, double done) {
      return static_cast<made*>(user)->progress(done) ? 0 : 1;
    };
    check([&] { return solidtex_set_progress_callback(made_->handle, go_on, made_.get()); });
  }

  void set(const char* name, std::uint64_t value) {
    check([&] { return solidtex_set_integer(made_->handle, name, value); });
  }
  std::uint64_t integer(const char* name) const {
    std::uint64_t value = 0;
    check([&] { return solidtex_get_integer(handle(), name, &value); });
    return value;
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

  std::shared_ptr<made> made_;
};

}  // namespace solidtex
