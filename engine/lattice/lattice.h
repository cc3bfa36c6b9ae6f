// Evaluator of the lattice family: required regions backward, values forward, on absolute integer
// coordinates.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "engine/common/box.h"
#include "engine/common/scratch.h"
#include "engine/lattice/plan.h"
#include "engine/model/model.h"

namespace solidtex::engine {

// Output of a box: the channels of voxel (x, y, z), relative to the corner of the box, begin at
// data[x * x_pitch + y * y_pitch + z * channels].
struct BoxTarget {
  float* data = nullptr;
  std::ptrdiff_t x_pitch = 0, y_pitch = 0;
};

class Lattice {
 public:
  // The solid repeats after `period` texels on every axis, 0 for never: noise does, level by level.
  Lattice(LatticeModel model, NoiseScheme scheme, std::uint64_t seed, std::uint64_t period = 0);
  Lattice(Lattice&&) noexcept;
  ~Lattice();

  int channels() const;

  // Evaluates one box on the calling thread, in steps along x. Memory grows with the y and z sizes
  // of the box. Callers split wide boxes; every split gives the same bits.
  void evaluate(const Box& box, const BoxTarget& target) const;
  // Evaluates one box into values in the order [x][y][z][channel].
  void evaluate(const Box& box, float* values) const;
  // The same for the solid without a period.
  void evaluate_endless(const Box& box, float* values) const;

  // Counts the memory of the evaluations; users of a lattice may add theirs.
  ScratchMeter& scratch() const;

 private:
  struct Workspaces;

  BoxTarget whole(const Box& box, float* values) const;
  void run(const Box& box, const BoxTarget& target, std::int64_t period) const;

  LatticeModel model_;
  Plan plan_;
  NoiseScheme scheme_;
  std::uint64_t seed_;
  std::int64_t period_;
  std::unique_ptr<Workspaces> workspaces_;  // one per thread
};

}  // namespace solidtex::engine
