// Header-only C++20 wrapper over solidtex.h: RAII, exceptions and spans. solidtex.h documents every
// function.
#pragma once

#include <solidtex/solidtex.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <initializer_list>
#include <limits>
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

// Returns the names of the models that are found without a path. See solidtex_model_names.
inline std::vector<std::string> models() {
  solidtex_clear_error();
  const char* at = solidtex_model_names();
  if (!at) throw error(solidtex_error_status(), solidtex_error_message());
  std::vector<std::string> names;
  while (*at) {
    const char* end = std::strchr(at, '\n');
    names.emplace_back(at, end);
    at = end + 1;
  }
  return names;
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
  std::uint64_t period = 0;
};

// Progress of one query: receives the finished fraction and returns true to cancel the query. It
// must not throw. See solidtex_token.
using progress = std::function<bool(double done)>;

// Footprints of the points of a query: a radius for each of n points, or nine floats of axes. Both
// empty means none. See solidtex_footprints.
struct footprints {
  std::span<const float> radii = {};  // n
  std::span<const float> axes = {};   // 9 n
};

namespace detail {

// Runs a call of the C interface and throws the error of a failed one.
template <class Call>
void check(Call call) {
  solidtex_clear_error();
  const solidtex_status status = call();
  if (status != SOLIDTEX_OK) throw error(status, solidtex_error_message());
}

// Token that calls a progress function, which must live as long.
inline solidtex_token token_of(const progress& report) {
  const auto callback = [](void* user, double done) {
    return (*static_cast<const progress*>(user))(done) ? 1 : 0;
  };
  return {sizeof(solidtex_token), report ? +callback : nullptr, const_cast<progress*>(&report)};
}

inline std::string text(const char* found) { return found ? found : ""; }

inline void require(bool condition, const char* message) {
  if (!condition) throw error(SOLIDTEX_INVALID_ARGUMENT, message);
}

// Refuses an array of another size than the product of `shape`.
inline void require_shape(const char* name, std::size_t found,
                          std::initializer_list<std::size_t> shape) {
  constexpr std::size_t largest = std::numeric_limits<std::size_t>::max();
  std::size_t expected = 1;
  for (const std::size_t factor : shape) {
    expected = factor && expected > largest / factor ? largest : expected * factor;
  }
  if (found == expected) return;
  std::string product;
  for (const std::size_t factor : shape) {
    product += (product.empty() ? "" : " x ") + std::to_string(factor);
  }
  throw error(SOLIDTEX_INVALID_ARGUMENT, std::string(name) + ": found " + std::to_string(found) +
                                             " floats, expected " + product);
}

}  // namespace detail

// Material of a texture space. `colors` is empty where the space has none.
struct material {
  std::vector<float> code;
  std::vector<float> colors = {};  // 12 floats, see solidtex.h
};

class space;

// Open model. Copies share it. Queries are const: any number of threads may run them.
class texture {
 public:
  // Opens a model by path or by the bare name of a shipped model.
  explicit texture(const std::string& model, options chosen = {}) : texture(std::move(chosen)) {
    detail::check([&] { return solidtex_open(state_->handle, model.c_str()); });
  }

  // Opens a model from the bytes of a .solidtex file.
  static texture from_memory(std::span<const std::byte> bytes, options chosen = {}) {
    texture opened(std::move(chosen));
    detail::require(!bytes.empty(), "bytes: found none, expected those of a .solidtex file");
    detail::check(
        [&] { return solidtex_open_memory(opened.state_->handle, bytes.data(), bytes.size()); });
    return opened;
  }

  solidtex_family family() const { return solidtex_get_family(handle()); }
  std::size_t channel_count() const { return solidtex_channel_count(handle()); }
  std::string channel_name(std::size_t channel) const {
    return detail::text(solidtex_channel_name(handle(), channel));
  }
  std::string color_space() const { return detail::text(solidtex_color_space(handle())); }
  std::string name() const { return detail::text(solidtex_name(handle())); }
  std::string path() const { return detail::text(solidtex_path(handle())); }
  std::uint64_t seed() const { return integer("seed"); }
  std::string precision() const {
    const char* found = nullptr;
    detail::check([&] { return solidtex_get_string(handle(), "precision", &found); });
    return found;
  }
  std::string metadata_json() const { return detail::text(solidtex_metadata_json(handle())); }
  std::uint64_t parameter_count() const { return solidtex_parameter_count(handle()); }

  // Evaluates n points, averaged over their footprints. See solidtex_eval.
  //   points     n x 3 floats relative to the origin
  //   values     receives n x channel_count() floats
  //   jacobians  receives n x channel_count() x 3 floats unless it is empty
  //   report     progress of this query
  void eval(const std::array<double, 3>& origin, std::span<const float> points,
            const footprints& over, std::span<float> values, std::span<float> jacobians = {},
            const progress& report = {}) const {
    const std::size_t count = count_of(points);
    if (!over.radii.empty()) detail::require_shape("radii", over.radii.size(), {count});
    if (!over.axes.empty()) detail::require_shape("axes", over.axes.size(), {count, 3, 3});
    const std::size_t channels = open_channel_count();
    detail::require_shape("values", values.size(), {count, channels});
    if (!jacobians.empty()) {
      detail::require_shape("jacobians", jacobians.size(), {count, channels, 3});
    }
    const solidtex_footprints given{sizeof(solidtex_footprints),
                                    over.radii.empty() ? nullptr : over.radii.data(),
                                    over.axes.empty() ? nullptr : over.axes.data()};
    const bool has_footprints = given.radii || given.axes;
    const solidtex_token token = detail::token_of(report);
    detail::check([&] {
      return solidtex_eval_with_token(handle(), origin.data(), points.data(),
                                      has_footprints ? &given : nullptr, count, values.data(),
                                      jacobians.empty() ? nullptr : jacobians.data(), &token);
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
    detail::require_shape("radii", radii.size(), {count_of(points)});
    eval(origin, points, {.radii = radii}, values, jacobians);
  }

  // Evaluates n points with three axes each.
  void eval_footprints(const std::array<double, 3>& origin, std::span<const float> points,
                       std::span<const float> axes, std::span<float> values,
                       std::span<float> jacobians = {}) const {
    detail::require_shape("axes", axes.size(), {count_of(points), 3, 3});
    eval(origin, points, {.axes = axes}, values, jacobians);
  }

  // Evaluates the voxels [origin, origin + size) into values in the order [x][y][z][channel].
  void eval_box(const std::array<std::int64_t, 3>& origin, const std::array<std::int64_t, 3>& size,
                std::span<float> values, const progress& report = {}) const {
    detail::require(size[0] >= 0 && size[1] >= 0 && size[2] >= 0,
                    "size: found a negative number, expected 0 or more");
    detail::require_shape("values", values.size(),
                          {static_cast<std::size_t>(size[0]), static_cast<std::size_t>(size[1]),
                           static_cast<std::size_t>(size[2]), open_channel_count()});
    const solidtex_token token = detail::token_of(report);
    detail::check([&] {
      return solidtex_eval_box_with_token(handle(), origin.data(), size.data(), values.data(),
                                          &token);
    });
  }

  // Returns the work done so far.
  solidtex_statistics statistics() const {
    solidtex_statistics found{};
    found.struct_size = sizeof found;
    detail::check([&] { return solidtex_get_statistics(handle(), &found); });
    return found;
  }

  // Returns the C handle. It is valid while this texture or a copy of it lives.
  const solidtex_texture* handle() const { return state_ ? state_->handle : nullptr; }

 private:
  friend class space;

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
    set("period", chosen.period);
    detail::check(
        [&] { return solidtex_set_string(state_->handle, "precision", chosen.precision.c_str()); });
    if (!state_->progress_callback) return;
    const auto callback = [](void* user, double done) {
      return static_cast<state*>(user)->progress_callback(done) ? 1 : 0;
    };
    detail::check(
        [&] { return solidtex_set_progress_callback(state_->handle, callback, state_.get()); });
  }

  void set(const char* name, std::uint64_t value) {
    detail::check([&] { return solidtex_set_integer(state_->handle, name, value); });
  }
  std::uint64_t integer(const char* name) const {
    std::uint64_t value = 0;
    detail::check([&] { return solidtex_get_integer(handle(), name, &value); });
    return value;
  }

  static std::size_t count_of(std::span<const float> points) {
    const std::size_t count = points.size() / 3;
    if (points.size() == 3 * count) return count;
    throw error(SOLIDTEX_INVALID_ARGUMENT, "points: found " + std::to_string(points.size()) +
                                               " floats, expected three for each point");
  }

  std::size_t open_channel_count() const {
    detail::require(state_ != nullptr,
                    "texture: found one that was moved from, expected an open one");
    return channel_count();
  }

  std::shared_ptr<state> state_;
};

// Open texture space. Copies share it. Any number of threads may use it. See solidtex.h.
class space {
 public:
  // Opens a space by path or by the bare name of a shipped space.
  explicit space(const std::string& path_or_name) {
    solidtex_clear_error();
    handle_.reset(solidtex_space_open(path_or_name.c_str()), solidtex_space_release);
    if (!handle_) throw error(solidtex_error_status(), solidtex_error_message());
  }

  std::string name() const { return detail::text(solidtex_space_name(handle())); }
  std::string path() const { return detail::text(solidtex_space_path(handle())); }
  std::string sha256() const { return detail::text(solidtex_space_sha256(handle())); }
  std::string metadata_json() const { return detail::text(solidtex_space_metadata_json(handle())); }
  solidtex_family family() const { return solidtex_space_family(handle()); }
  std::size_t code_size() const { return solidtex_space_code_size(handle()); }
  bool has_colors() const { return solidtex_space_has_colors(handle()) != 0; }
  std::size_t patch_size() const { return solidtex_space_patch_size(handle()); }
  std::size_t resolution() const { return solidtex_space_resolution(handle()); }

  // Training photographs: their number, and name and material of each.
  std::size_t photograph_count() const { return solidtex_space_photograph_count(handle()); }
  std::string photograph_name(std::size_t index) const {
    return detail::text(solidtex_space_photograph_name(handle(), index));
  }
  material photograph(std::size_t index) const {
    material found = room();
    detail::check([&] {
      return solidtex_space_photograph(handle(), index, found.code.data(), found.colors.data());
    });
    return found;
  }

  // Encodes a photograph: width x height x 3 floats, sRGB, 0 to 1. Needs ONNX Runtime.
  material encode(std::span<const float> pixels, std::size_t width, std::size_t height,
                  solidtex_patches patches = SOLIDTEX_PATCHES_AVERAGE) const {
    detail::require(
        width > 0 && pixels.size() / 3 / width == height && pixels.size() == 3 * width * height,
        "pixels must hold width x height x 3 floats");
    material result = room();
    detail::check([&] {
      return solidtex_space_encode(handle(), pixels.data(), width, height, patches,
                                   result.code.data(), result.colors.data());
    });
    return result;
  }

  // Blends materials. The weights are divided by their sum.
  material blend(std::span<const material> materials, std::span<const double> weights) const {
    detail::require(materials.size() == weights.size(), "weights must hold one for each material");
    std::vector<float> codes, colors;
    for (const material& one : materials) {
      check_sizes(one);
      codes.insert(codes.end(), one.code.begin(), one.code.end());
      colors.insert(colors.end(), one.colors.begin(), one.colors.end());
    }
    material result = room();
    detail::check([&] {
      return solidtex_space_blend(handle(), materials.size(), weights.data(), codes.data(),
                                  colors.data(), result.code.data(), result.colors.data());
    });
    return result;
  }

  // Opens a material. `details` is "" or the JSON object of solidtex_space_texture.
  texture open(const material& chosen, const std::string& details = "",
               options parameters = {}) const {
    check_sizes(chosen);
    texture opened(std::move(parameters));
    detail::check([&] {
      return solidtex_space_texture(handle(), chosen.code.data(), chosen.colors.data(),
                                    details.empty() ? nullptr : details.c_str(),
                                    opened.state_->handle);
    });
    return opened;
  }

  // Writes a material as a .solidtex file.
  void write_model(const material& chosen, const std::string& details,
                   const std::string& file) const {
    check_sizes(chosen);
    detail::check([&] {
      return solidtex_space_write_model(handle(), chosen.code.data(), chosen.colors.data(),
                                        details.empty() ? nullptr : details.c_str(), file.c_str());
    });
  }

  // Returns the C handle. It is valid while this space or a copy of it lives.
  const solidtex_space* handle() const { return handle_.get(); }

 private:
  material room() const {
    return {std::vector<float>(code_size()), std::vector<float>(has_colors() ? 12 : 0)};
  }
  void check_sizes(const material& one) const {
    detail::require_shape("code", one.code.size(), {code_size()});
    detail::require_shape("colors", one.colors.size(), {has_colors() ? 12u : 0u});
  }

  std::shared_ptr<solidtex_space> handle_;
};

// Returns the SHA-256 of a file. See solidtex_file_sha256.
inline std::string file_sha256(const std::string& path) {
  char digest[65];
  detail::check([&] { return solidtex_file_sha256(path.c_str(), digest); });
  return digest;
}

}  // namespace solidtex
