// Laplace's equation on the pores: finite volumes on the faces between them, solved by conjugate
// gradients with the diagonal as preconditioner.
#pragma once

#include <vector>

#include "plugins/transport/pore_space.h"

namespace solidtex::transport {

// A potential that falls by 1 along the axis. Where the axis repeats it falls by 1 a period;
// elsewhere it is 1 on the near face and 0 on the far one, half a voxel from the centers.
class Laplace {
 public:
  using Vector = std::vector<double>;

  // `conductivities` of the pores; empty means 1. A face has their harmonic mean.
  explicit Laplace(const PoreSpace& space, const Vector& conductivities = {});

  // Returns the potential of each pore. Sets steps and has_converged of the result.
  Vector solve(double tolerance, std::int64_t max_steps, const Progress& progress,
               TransportResult& result) const;

  // Sum over the faces across the axis of flux times distance: the flux through one layer times
  // the number of layers.
  double total_flux(const Vector& potential) const;

 private:
  void set_row(std::size_t pore, const Vector& conductivities);
  double multiply(const Vector& x, Vector& product) const;

  const PoreSpace& space_;
  std::size_t count_;
  Vector diagonal_, right_side_;
  std::vector<std::uint32_t> neighbors_;  // [pore][face]
  std::vector<float> conductances_;       // [pore][face], empty if all are 1
};

}  // namespace solidtex::transport
