// Permeability and effective diffusivity of the pores of a voxel image, in units of voxels.
#pragma once

#include <array>
#include <cstdint>
#include <functional>

namespace solidtex::transport {

// Voxels in the order [x][y][z], 1 where a voxel is a pore, else 0.
struct VoxelImage {
  const std::uint8_t* is_pore = nullptr;
  std::array<std::int64_t, 3> size = {0, 0, 0};
};

// open: a pressure (or concentration) is held on the two faces across the axis; the others are
// sealed. periodic: the image repeats on every axis.
enum class Boundary { open, periodic };

// Called now and then with the number of steps and the present value. Ends the run if false.
using Progress = std::function<bool(std::int64_t steps, double value)>;

struct FlowSettings {
  int axis = 0;
  Boundary boundary = Boundary::open;
  double viscosity = 0;  // of the lattice: changes the steps, not the result. 0: chosen
  // Relative range of the value over the last third of the steps. The flow through the layers
  // across the axis varies by at most twice as much.
  double tolerance = 5e-3;
  std::int64_t max_steps = 100000;
};

struct DiffusionSettings {
  int axis = 0;
  Boundary boundary = Boundary::open;
  double tolerance = 1e-6;  // of the residual, relative to the right side
  std::int64_t max_steps = 100000;
};

// value is 0 and conducting_voxels is 0 if no path of pores leads along the axis.
struct TransportResult {
  double value = 0;
  std::int64_t conducting_voxels = 0;  // pores connected to both faces
  std::int64_t steps = 0;
  bool has_converged = true;
};

// Voxels connected through faces to both ends of the axis. With a periodic boundary: voxels of
// components that reach their own copy in the next period.
std::int64_t count_conducting(const VoxelImage& image, int axis, Boundary boundary);

// Permeability in voxels squared, by a lattice-Boltzmann solver.
TransportResult permeability(const VoxelImage& image, const FlowSettings& settings,
                             const Progress& progress = {});

// Effective diffusivity relative to that of the free pore fluid, by finite volumes.
TransportResult diffusivity(const VoxelImage& image, const DiffusionSettings& settings,
                            const Progress& progress = {});

}  // namespace solidtex::transport
