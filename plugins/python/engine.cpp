// solidtex._engine: solidtex.h for Python. Checks the memory of arrays, runs queries without the
// interpreter's lock and lets signals cancel them. solidtex/texture.py is the public interface.
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "space.h"

namespace nb = nanobind;
using nb::literals::operator""_a;

namespace {

using AnyArray = nb::ndarray<>;
using Floats = nb::ndarray<const float, nb::c_contig, nb::device::cpu>;

// Progress of one query for a function of the caller: what it returned, and what it raised.
struct Report {
  nb::object function;
  nb::object error = {};

  // Cancels the query when the function returns a true value, or raises.
  static int callback(void* user, double done) {
    Report& report = *static_cast<Report*>(user);
    const nb::gil_scoped_acquire lock;
    try {
      return nb::cast<bool>(nb::bool_(report.function(done)));
    } catch (nb::python_error& raised) {
      report.error = nb::borrow(raised.value());
      return 1;
    }
  }
  solidtex_token token() {
    return {sizeof(solidtex_token), function.is_none() ? nullptr : callback, this};
  }
  void raise_error() const {
    if (!error.is_valid()) return;
    PyErr_SetObject(error.type().ptr(), error.ptr());
    throw nb::python_error();
  }
};

// Progress callback: cancels the query when the handler of a signal has raised.
int signal_has_raised(void*, double) {
  const nb::gil_scoped_acquire lock;
  return PyErr_CheckSignals();
}

// Runs a query without the interpreter's lock. Signal handlers run on the main thread; an exception
// of theirs, such as KeyboardInterrupt, ends the query.
template <class Query>
void run(const nb::object& progress, const Query& query) {
  Report report{progress};
  const solidtex_token token = report.token();
  solidtex_clear_error();
  solidtex_status status;
  {
    const nb::gil_scoped_release unlocked;
    status = query(&token);
  }
  if (PyErr_Occurred()) throw nb::python_error();
  report.raise_error();
  check(status);
}

std::string shape_of(const AnyArray& array) {
  std::string result = "(";
  for (std::size_t axis = 0; axis < array.ndim(); ++axis)
    result += (axis ? ", " : "") + std::to_string(array.shape(axis));
  return result + (array.ndim() == 1 ? ",)" : ")");
}

// Returns the memory of the caller's array. Never copies.
float* target(const AnyArray& out, std::size_t size) {
  require(out.device_type() == nb::device::cpu::value,
          "out: found memory of another device, expected memory of the CPU");
  require(out.dtype() == nb::dtype<float>(), "out: found another type, expected float32");
  require(out.size() == size, "out: found shape " + shape_of(out) + ", expected room for " +
                                  std::to_string(size) + " values");
  std::int64_t stride = 1;
  for (std::size_t axis = out.ndim(); axis-- > 0;) {
    require(out.shape(axis) == 1 || size == 0 || out.stride(axis) == stride,
            "out: found gaps between the values, expected a contiguous array in C order");
    stride *= static_cast<std::int64_t>(out.shape(axis));
  }
  return static_cast<float*>(out.data());
}

void require_apart(const float* out, std::size_t size, const Floats& input, const char* name) {
  const float* begin = input.data();
  require(out + size <= begin || begin + input.size() <= out,
          std::string("out: found the memory of ") + name + ", expected memory of its own");
}

class Texture {
 public:
  Texture(const nb::bytes& model, std::uint64_t seed, const std::string& precision,
          std::uint64_t cache_limit, std::uint64_t threads, std::uint64_t period)
      : Texture(seed, precision, cache_limit, threads, period) {
    open([&] { return solidtex_open(handle_.get(), model.c_str()); });
  }

  static Texture from_bytes(const nb::bytes& data, std::uint64_t seed, const std::string& precision,
                            std::uint64_t cache_limit, std::uint64_t threads,
                            std::uint64_t period) {
    Texture result(seed, precision, cache_limit, threads, period);
    result.open(
        [&] { return solidtex_open_memory(result.handle_.get(), data.c_str(), data.size()); });
    return result;
  }

  // Opens the material of a space.
  static Texture from_space(const Space& space, const Material& material, const nb::bytes& details,
                            std::uint64_t seed, const std::string& precision,
                            std::uint64_t cache_limit, std::uint64_t threads,
                            std::uint64_t period) {
    Texture result(seed, precision, cache_limit, threads, period);
    result.open([&] {
      return solidtex_space_texture(space.get(), material.code.data(), material.colors.data(),
                                    details.c_str(), result.handle_.get());
    });
    return result;
  }

  // Releases the texture. The last running query frees it.
  void close() { handle_.reset(); }

  std::string family() const {
    return solidtex_get_family(get()) == SOLIDTEX_FAMILY_SAMPLER ? "sampler" : "lattice";
  }
  std::string color_space() const { return text(solidtex_color_space(get())); }
  std::string name() const { return text(solidtex_name(get())); }
  nb::object path() const {
    const std::string found = text(solidtex_path(get()));
    PyObject* decoded =
        PyUnicode_DecodeFSDefaultAndSize(found.data(), static_cast<Py_ssize_t>(found.size()));
    if (!decoded) throw nb::python_error();
    return nb::steal(decoded);
  }
  std::string metadata_json() const { return text(solidtex_metadata_json(get())); }
  std::uint64_t parameter_count() const { return solidtex_parameter_count(get()); }
  std::vector<std::string> channels() const {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < channel_count(); ++i)
      names.push_back(text(solidtex_channel_name(get(), i)));
    return names;
  }
  std::array<std::uint64_t, 10> statistics() const {
    solidtex_statistics found{};
    found.struct_size = sizeof found;
    solidtex_clear_error();
    check(solidtex_get_statistics(get(), &found));
    return {found.point_count,   found.voxel_count,       found.hit_count,      found.miss_count,
            found.brick_count,   found.brick_nanoseconds, found.resident_bytes, found.peak_bytes,
            found.scratch_bytes, found.peak_scratch_bytes};
  }

  // Evaluates points. At most one of radii and axes is given.
  void eval(const Floats& points, const std::array<double, 3>& origin,
            const std::optional<Floats>& radii, const std::optional<Floats>& axes,
            const AnyArray& out, const std::optional<AnyArray>& jacobians,
            const nb::object& progress) const {
    const Handle texture = held();
    const std::size_t count = points.size() / 3, size = count * channel_count();
    require(points.size() % 3 == 0, "points: found no multiple of three numbers");
    require(!radii || radii->size() == count, "radii: found another count than that of points");
    require(!axes || axes->size() == 9 * count, "axes: found another count than nine per point");
    require(!radii || !axes, "radii, axes: found both, expected one of them");
    float* values = target(out, size);
    require_apart(values, size, points, "points");
    if (radii) require_apart(values, size, *radii, "radii");
    if (axes) require_apart(values, size, *axes, "axes");
    float* derivatives = jacobians ? target(*jacobians, 3 * size) : nullptr;
    const solidtex_footprints footprints = {sizeof footprints, radii ? radii->data() : nullptr,
                                            axes ? axes->data() : nullptr};
    run(progress, [&](const solidtex_token* token) {
      return solidtex_eval_with_token(texture.get(), origin.data(), points.data(),
                                      radii || axes ? &footprints : nullptr, count, values,
                                      derivatives, token);
    });
  }

  void eval_box(const std::array<std::int64_t, 3>& origin, const std::array<std::int64_t, 3>& size,
                const AnyArray& out, const nb::object& progress) const {
    const Handle texture = held();
    std::size_t values = channel_count();
    for (const std::int64_t extent : size) {
      require(extent >= 0, "size: found a negative number, expected 0 or more");
      values *= static_cast<std::size_t>(extent);
    }
    float* corner = target(out, values);
    run(progress, [&](const solidtex_token* token) {
      return solidtex_eval_box_with_token(texture.get(), origin.data(), size.data(), corner, token);
    });
  }

 private:
  using Handle = std::shared_ptr<solidtex_texture>;

  Texture(std::uint64_t seed, const std::string& precision, std::uint64_t cache_limit,
          std::uint64_t threads, std::uint64_t period)
      : handle_(solidtex_new(), solidtex_release) {
    solidtex_clear_error();
    solidtex_texture* made = handle_.get();
    check(solidtex_set_integer(made, "seed", seed));
    check(solidtex_set_string(made, "precision", precision.c_str()));
    check(solidtex_set_integer(made, "cache_limit_bytes", cache_limit));
    check(solidtex_set_integer(made, "threads", threads));
    check(solidtex_set_integer(made, "period", period));
    check(solidtex_set_progress_callback(made, signal_has_raised, nullptr));
  }

  template <class Open>
  static void open(const Open& open_model) {
    solidtex_status status;
    {
      const nb::gil_scoped_release unlocked;
      status = open_model();
    }
    check(status);
  }

  const Handle& held() const {
    require(handle_ != nullptr, "texture: found it closed, expected an open one");
    return handle_;
  }
  const solidtex_texture* get() const { return held().get(); }
  std::size_t channel_count() const { return solidtex_channel_count(get()); }

  Handle handle_;
};

}  // namespace

NB_MODULE(_engine, m) {
  m.doc() = "Bindings of libsolidtex. Use the package solidtex instead.";
  m.def(
      "version", [] { return std::string(solidtex_version()); },
      "Return the version of libsolidtex.");
  m.def(
      "target",
      [] {
        solidtex_clear_error();
        const char* name = solidtex_target();
        if (!name) check(solidtex_error_status());
        return std::string(name);
      },
      "Return the name of the instruction set in use.");
  m.def(
      "model_names",
      [] {
        solidtex_clear_error();
        const char* names = solidtex_model_names();
        if (!names) check(solidtex_error_status());
        return std::string(names);
      },
      "Return the names of the models that are found without a path, one a line.");
  bind_space(m);
  nb::class_<Texture>(m, "Texture", "An open model.")
      .def(nb::init<const nb::bytes&, std::uint64_t, const std::string&, std::uint64_t,
                    std::uint64_t, std::uint64_t>(),
           "model"_a, "seed"_a, "precision"_a, "cache_limit"_a, "threads"_a, "period"_a)
      .def_static("from_bytes", &Texture::from_bytes, "data"_a, "seed"_a, "precision"_a,
                  "cache_limit"_a, "threads"_a, "period"_a)
      .def_static("from_space", &Texture::from_space, "space"_a, "material"_a, "details"_a,
                  "seed"_a, "precision"_a, "cache_limit"_a, "threads"_a, "period"_a)
      .def("close", &Texture::close)
      .def_prop_ro("family", &Texture::family)
      .def_prop_ro("color_space", &Texture::color_space)
      .def_prop_ro("name", &Texture::name)
      .def_prop_ro("path", &Texture::path, nb::sig("def path(self) -> str"))
      .def_prop_ro("metadata_json", &Texture::metadata_json)
      .def_prop_ro("parameter_count", &Texture::parameter_count)
      .def_prop_ro("channels", &Texture::channels)
      .def("statistics", &Texture::statistics)
      .def("eval", &Texture::eval, "points"_a, "origin"_a, "radii"_a.none(), "axes"_a.none(),
           "out"_a, "jacobians"_a.none() = nb::none(), "progress"_a.none() = nb::none(),
           nb::sig("def eval(self, points: object, origin: tuple[float, float, float], "
                   "radii: object | None, axes: object | None, out: object, "
                   "jacobians: object | None = None, progress: object | None = None) -> None"))
      .def("eval_box", &Texture::eval_box, "origin"_a, "size"_a, "out"_a,
           "progress"_a.none() = nb::none(),
           nb::sig("def eval_box(self, origin: tuple[int, int, int], size: tuple[int, int, int], "
                   "out: object, progress: object | None = None) -> None"));
}
