// Lattice family: required regions backward, evaluation forward, on absolute integer coordinates.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "engine/common/box.h"
#include "engine/lattice/plan.h"
#include "engine/model/model.h"

namespace solidtex::engine {

// Where the values of a box go: voxel (x, y, z), relative to its corner, has its channels from
// data[x * x_pitch + y * y_pitch + z * channels] on.
struct BoxTarget {
  float* data = nullptr;
  std::ptrdiff_t x_pitch = 0, y_pitch = 0;
};

class Lattice {
 public:
  Lattice(LatticeModel model, NoiseScheme scheme, std::uint64_t seed);
  Lattice(Lattice&&) noexcept;
  ~Lattice();

  int channels() const;

  // Evaluates one box on the calling thread, in steps along x. Memory grows with its y and z, not
  // with its x: callers split wide boxes (texture/ does), any split gives the same bits.
  void evaluate(const Box& box, const BoxTarget& target) const;
  // The same, to values in [x][y][z][channel] order.
  void evaluate(const Box& box, float* values) const;

 private:
  struct Workspaces;

  LatticeModel model_;
  Plan plan_;
  NoiseScheme scheme_;
  std::uint64_t seed_;
  std::unique_ptr<Workspaces> workspaces_;  // one for each thread that has evaluated
};

}  // namespace solidtex::engine
