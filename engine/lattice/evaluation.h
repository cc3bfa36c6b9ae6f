// Evaluation of one block of a graph in steps along x.
//
// Every node keeps a ring of the planes that later steps need. A long block needs no margin along
// x, and its working set stays in the second-level cache.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "engine/lattice/block.h"
#include "engine/lattice/lattice.h"
#include "engine/lattice/plan.h"
#include "engine/lattice/plane_ring.h"
#include "engine/model/model.h"

namespace solidtex::engine {

// Memory that the evaluations of one thread reuse.
class Workspace {
 public:
  // Returns at least `count` floats, all finite. The meter counts what is kept.
  float* floats(std::size_t count, ScratchMeter& meter);

 private:
  struct Free {
    void operator()(float* memory) const { std::free(memory); }
  };
  std::unique_ptr<float[], Free> memory_;
  std::size_t size_ = 0;
};

class Evaluation {
 public:
  // `period` is in texels, 0 for none.
  Evaluation(const LatticeModel& model, const Plan& plan, NoiseScheme scheme, std::uint64_t seed,
             std::int64_t period)
      : model_(model), plan_(plan), scheme_(scheme), seed_(seed), period_(period) {}

  void run(const Box& box, const BoxTarget& target, Workspace& workspace, ScratchMeter& meter);

 private:
  void find_regions(const Box& box, const std::vector<Box>& steps);
  void place_rings(Workspace& workspace, ScratchMeter& meter);
  Box kept_box(const Step& step, const Box& region) const;
  void advance(const Step& step, const Box& region);
  void compute(const Step& step, const Box& box);
  void convolve(const Step& step, const Box& box);
  void copy_coarse(int node, const Box& box) const;
  void compute_general(const Step& step, const Box& box);
  Block gather(int node, const Box& box) const;
  void read(int node, int channel, std::int64_t x, std::int64_t y, std::int64_t z_lo,
            std::int64_t z_hi, float* values) const;
  void write_output(const Box& box, const BoxTarget& target) const;

  bool is_upsample(int node) const {
    return std::holds_alternative<UpsampleOp>(model_.nodes[static_cast<std::size_t>(node)].op);
  }

  const LatticeModel& model_;
  const Plan& plan_;
  NoiseScheme scheme_;
  std::uint64_t seed_;
  std::int64_t period_;
  std::vector<std::vector<Box>> regions_;  // [step along x][node]
  std::vector<PlaneRing> rings_;           // [node]
  float* scratch_ = nullptr;
};

}  // namespace solidtex::engine
