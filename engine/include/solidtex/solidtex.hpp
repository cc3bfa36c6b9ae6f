// Header-only C++20 wrapper over solidtex.h: RAII, exceptions and spans. solidtex.h documents every
// function.
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

// Exception of a failed call: what() is the message of the library, status() its code.
class error : public std::runtime_error {
 public:
  error(solidtex_status status, const std::string& message)
      : std::runtime_error(message), status_(status) {}
  solidtex_status status() const { return status_; }

 private:
  solidtex_status status_;
};

// Returns the version of the library as "major.minor.patch".
inline std::string version() { return solidtex_version(); }

// Returns the name of the instruction set in use. See solidtex_target.
inline std::string target() {
  solidtex_clear_error();
  const char* name = solidtex_target();
  if (!name) throw error(solidtex_error_status(), solidtex_error_message());
  return name;
}

// Parameters of a texture. See solidtex_set_integer and solidtex_set_string.
struct options {
  std::uint64_t seed = 0;
  std::uint64_t cache_limit_bytes = 256ull << 20;
  std::string precision = "full";
  std::uint64_t threads = 0;
  // Progress callback: receives the finished fraction of a query and returns true to cancel it, as
  // a solidtex_progress_callback does. It must not throw. Each querying thread calls it, several at
  // once.
  std::function<bool(double done)> progress_callback = {};
};

// Footprints of the points of a query: a radius for each of n points, or nine floats of axes. Both
// empty means none. See solidtex_footprints.
struct footprints {
  std::span<const float> radii = {};  // n
  std::span<const float> axes = {};   // 9 n
};

// Open model. Copies share it. Queries are const: any number of threads may run them.
class texture {
 public:
  // Opens a model by path or by the bare name of a shipped model.
  explicit texture(const std::string& model, options chosen = {}) : texture(std::move(chosen)) {
    check([&] { return solidtex_open(state_->handle, model.c_str()); });
  }

  // Opens a model from the bytes of a .solidtex file.
  static texture from_memory(std::span<const std::byte> bytes, options chosen = {}) {
    texture opened(std::move(chosen));
    check([&] { return solidtex_open_memory(opened.state_->handle, bytes.data(), bytes.size()); });
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

  // Evaluates n points, averaged over their footprints. See solidtex_eval.
  //   points     n x 3 floats relative to the origin
  //   values     receives n x channel_count() floats
  //   jacobians  receives n x channel_count() x 3 floats unless it is empty
  void eval(const std::array<double, 3>& origin, std::span<const float> points,
            const footprints& over, std::span<float> values,
            std::span<float> jacobians = {}) const {
    const std::size_t count = points.size() / 3;
    require(points.size() == 3 * count, "points must hold n x 3 floats");
    require(over.radii.empty() || over.radii.size() == count, "radii must hold n floats");
    require(over.axes.empty() || over.axes.size() == 9 * count, "axes must hold n x 9 floats");
    require_output(count, values, jacobians);
    const solidtex_footprints given{sizeof(solidtex_footprints),
                                    over.radii.empty() ? nullptr : over.radii.data(),
                                    over.axes.empty() ? nullptr : over.axes.data()};
    const bool has_footprints = given.radii || given.axes;
    check([&] {
      return solidtex_eval(handle(), origin.data(), points.data(),
                           has_footprints ? &given : nullptr, count, values.data(),
                           jacobians.empty() ? nullptr : jacobians.data());
    });
  }

  // Evaluates points without footprints.
  void eval_points(const std::array<double, 3>& origin, std::span<const float> points,
                   std::span<float> values, std::span<float> jacobians = {}) const {
    eval(origin, points, {}, values, jacobians);
  }

  // Evaluates n points with one radius each.
  void eval_filtered(const std::array<double, 3>& origin, std::span<const float> points,
                     std::span<const float> radii, std::span<float> values,
                     std::span<float> jacobians = {}) const {
    require(points.size() == 3 * radii.size(), "radii must hold n floats, points n x 3");
    eval(origin, points, {.radii = radii}, values, jacobians);
  }

  // Evaluates n points with three axes each.
  void eval_footprints(const std::array<double, 3>& origin, std::span<const float> points,
                       std::span<const float> axes, std::span<float> values,
                       std::span<float> jacobians = {}) const {
    require(3 * points.size() == axes.size(), "axes must hold n x 9 floats, points n x 3");
    eval(origin, points, {.axes = axes}, values, jacobians);
  }

  // Evaluates the voxels [origin, origin + size) into values in the order [x][y][z][channel].
  void eval_box(const std::array<std::int64_t, 3>& origin, const std::array<std::int64_t, 3>& size,
                std::span<float> values) const {
    require(size[0] >= 0 && size[1] >= 0 && size[2] >= 0 &&
                values.size() == static_cast<std::size_t>(size[0]) *
                                     static_cast<std::size_t>(size[1]) *
                                     static_cast<std::size_t>(size[2]) * channel_count(),
            "values must hold size[0] x size[1] x size[2] x channels floats");
    check([&] { return solidtex_eval_box(handle(), origin.data(), size.data(), values.data()); });
  }

  // Returns the work done so far.
  solidtex_statistics statistics() const {
    solidtex_statistics found{};
    found.struct_size = sizeof found;
    check([&] { return solidtex_get_statistics(handle(), &found); });
    return found;
  }

  // Returns the C handle. It is valid while this texture or a copy of it lives.
  const solidtex_texture* handle() const { return state_ ? state_->handle : nullptr; }

 private:
  // Owns the handle and the callback that the handle calls.
  struct state {
    explicit state(options chosen) : progress_callback(std::move(chosen.progress_callback)) {}
    state(const state&) = delete;
    state& operator=(const state&) = delete;
    ~state() { solidtex_release(handle); }

    std::function<bool(double)> progress_callback;
    solidtex_texture* handle = solidtex_new();
  };

  explicit texture(options chosen) : state_(std::make_shared<state>(chosen)) {
    if (!state_->handle) throw error(SOLIDTEX_OUT_OF_MEMORY, "not enough memory");
    set("seed", chosen.seed);
    set("cache_limit_bytes", chosen.cache_limit_bytes);
    set("threads", chosen.threads);
    check(
        [&] { return solidtex_set_string(state_->handle, "precision", chosen.precision.c_str()); });
    if (!state_->progress_callback) return;
    const auto callback = [](void* user, double done) {
      return static_cast<state*>(user)->progress_callback(done) ? 1 : 0;
    };
    check([&] { return solidtex_set_progress_callback(state_->handle, callback, state_.get()); });
  }

  void set(const char* name, std::uint64_t value) {
    check([&] { return solidtex_set_integer(state_->handle, name, value); });
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

  void require_output(std::size_t count, std::span<float> values,
                      std::span<float> jacobians) const {
    const std::size_t size = count * channel_count();
    require(values.size() == size, "values must hold n x channels floats");
    require(jacobians.empty() || jacobians.size() == 3 * size,
            "jacobians must hold n x channels x 3 floats");
  }

  template <class Call>
  static void check(Call call) {
    solidtex_clear_error();
    const solidtex_status status = call();
    if (status != SOLIDTEX_OK) throw error(status, solidtex_error_message());
  }

  std::shared_ptr<state> state_;
};

}  // namespace solidtex
