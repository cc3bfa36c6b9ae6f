// solidtex._transport: permeability and diffusivity of voxel images for Python. Runs without the
// interpreter's lock and lets signals end a run. solidtex/transport.py is the public interface.
#include "plugins/transport/transport.h"

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>
#include <tbb/task_arena.h>

#include <functional>
#include <optional>
#include <tuple>

namespace nb = nanobind;
using nb::literals::operator""_a;
namespace transport = solidtex::transport;

namespace {

using Pores = nb::ndarray<const std::uint8_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Report = std::function<void(std::int64_t, double)>;
using Result = std::tuple<double, std::int64_t, std::int64_t, bool>;

transport::VoxelImage image_of(const Pores& pores) {
  transport::VoxelImage image{pores.data(), {}};
  for (std::size_t axis = 0; axis < 3; ++axis)
    image.size[axis] = static_cast<std::int64_t>(pores.shape(axis));
  return image;
}

transport::Boundary boundary_of(bool is_periodic) {
  return is_periodic ? transport::Boundary::periodic : transport::Boundary::open;
}

template <class Settings, class Solve>
Result solve(const Pores& pores, int axis, bool is_periodic, double tolerance,
             std::int64_t max_steps, int threads, const std::optional<Report>& report,
             const Solve& solver) {
  Settings settings;
  settings.axis = axis;
  settings.boundary = boundary_of(is_periodic);
  settings.tolerance = tolerance;
  settings.max_steps = max_steps;
  const transport::Progress progress = [&](std::int64_t steps, double value) {
    const nb::gil_scoped_acquire lock;
    if (PyErr_CheckSignals() != 0) return false;
    try {
      if (report) (*report)(steps, value);
    } catch (nb::python_error& error) {
      error.restore();  // raised again after the run
      return false;
    }
    return true;
  };
  transport::TransportResult found;
  {
    const nb::gil_scoped_release unlocked;
    // The solver's own thread calls `progress`: on the main thread that is where signals arrive.
    tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
    arena.execute([&] { found = solver(image_of(pores), settings, progress); });
  }
  if (PyErr_Occurred()) throw nb::python_error();
  return {found.value, found.conducting_voxels, found.steps, found.has_converged};
}

}  // namespace

NB_MODULE(_transport, m) {
  m.doc() = "Permeability and diffusivity of voxel images. solidtex.transport is the interface.";
  m.def(
      "permeability",
      [](const Pores& pores, int axis, bool is_periodic, double tolerance, std::int64_t max_steps,
         int threads, const std::optional<Report>& report, double viscosity) {
        return solve<transport::FlowSettings>(
            pores, axis, is_periodic, tolerance, max_steps, threads, report,
            [&](const auto& image, auto& settings, const auto& progress) {
              settings.viscosity = viscosity;
              return transport::permeability(image, settings, progress);
            });
      },
      "pores"_a, "axis"_a, "is_periodic"_a, "tolerance"_a, "max_steps"_a, "threads"_a,
      "report"_a.none(), "viscosity"_a);
  m.def(
      "diffusivity",
      [](const Pores& pores, int axis, bool is_periodic, double tolerance, std::int64_t max_steps,
         int threads, const std::optional<Report>& report) {
        return solve<transport::DiffusionSettings>(
            pores, axis, is_periodic, tolerance, max_steps, threads, report,
            [](const auto& image, const auto& settings, const auto& progress) {
              return transport::diffusivity(image, settings, progress);
            });
      },
      "pores"_a, "axis"_a, "is_periodic"_a, "tolerance"_a, "max_steps"_a, "threads"_a,
      "report"_a.none());
  m.def(
      "count_conducting",
      [](const Pores& pores, int axis, bool is_periodic) {
        const nb::gil_scoped_release unlocked;
        return transport::count_conducting(image_of(pores), axis, boundary_of(is_periodic));
      },
      "pores"_a, "axis"_a, "is_periodic"_a);
}
