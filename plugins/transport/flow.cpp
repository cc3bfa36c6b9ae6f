// Stokes flow by the lattice-Boltzmann method on 19 velocities (D3Q19), on pore voxels alone.
//
// Collisions have two relaxation times. Their product is held at 1/8: the flow through a slit is
// then exact for any width in voxels and any viscosity, see docs/porous-media.md. The equilibrium
// is linear in the velocity, so the flow has no inertia. Populations are kept as deviations from
// the state at rest.
//
// One array holds the populations. An even step reads and writes the slots of the pore itself, an
// odd step those of its neighbors (Bailey et al. 2009, the AA pattern); both touch the same slots
// for reading and writing, so pores need no order and threads no lock.
//
// A pressure is held on an open face by a mirror image beyond it. The force along the axis is the
// mean gradient. Mirrored and turned round, the flow meets the same force, so the deviation of the
// pressure changes its sign at the face, and is zero on it: a population that leaves comes back as
// its mirror image with the other sign. A straight channel has its flow at any length.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "plugins/common/vector_clones.h"
#include "plugins/transport/laplace.h"

namespace solidtex::transport {
namespace {

constexpr int kPairs = 9, kVelocities = 2 * kPairs + 1;
constexpr int kBlock = 64;  // pores that collide together
constexpr std::size_t kBlocksPerTask = 64;
constexpr int kCheckSteps = 50;
constexpr double kMaxViscosity = 1;
constexpr double kLayerTolerance = 2;  // times the tolerance of the value

// Velocity 0 is at rest; 2 p + 1 is kAlong[p] and 2 p + 2 its opposite.
constexpr Offset kAlong[kPairs] = {{1, 0, 0}, {0, 1, 0},  {0, 0, 1}, {1, 1, 0}, {1, -1, 0},
                                   {1, 0, 1}, {1, 0, -1}, {0, 1, 1}, {0, 1, -1}};
constexpr float kWeightAtRest = 1.0f / 3;
constexpr float weight(int pair) { return pair < 3 ? 1.0f / 18 : 1.0f / 36; }
constexpr int opposite(int q) { return q == 0 ? 0 : q % 2 == 1 ? q + 1 : q - 1; }
Offset velocity(int q) {
  Offset along = kAlong[(q - 1) / 2];
  if (q % 2 == 0)
    for (int& component : along) component = -component;
  return along;
}

// The number of the velocity whose component along the axis is turned round.
int mirrored(int q, int axis) {
  Offset image = velocity(q);
  image[axis] = -image[axis];
  int number = 1;
  while (velocity(number) != image) ++number;
  return number;
}

struct Relaxation {
  float even, odd;  // rates of the symmetric and the antisymmetric part of a pair
  float force[3];   // per step
};

Relaxation relaxation(double viscosity, int axis) {
  constexpr double kWallProduct = 1.0 / 8;
  const double excess = 3 * viscosity;
  Relaxation result{static_cast<float>(1 / (excess + 0.5)),
                    static_cast<float>(1 / (kWallProduct / excess + 0.5)),
                    {0, 0, 0}};
  result.force[axis] = 1;
  return result;
}

struct alignas(64) Populations {
  float of[kVelocities][kBlock];
};

SOLIDTEX_VECTOR_CLONES void collide(Populations& f, const Relaxation& rate) {
  for (int i = 0; i < kBlock; ++i) {
    float density = f.of[0][i], even[kPairs], odd[kPairs], flow[3] = {0, 0, 0};
#pragma GCC unroll 9
    for (int p = 0; p < kPairs; ++p) {
      even[p] = f.of[2 * p + 1][i] + f.of[2 * p + 2][i];
      odd[p] = f.of[2 * p + 1][i] - f.of[2 * p + 2][i];
      density += even[p];
#pragma GCC unroll 3
      for (int k = 0; k < 3; ++k) flow[k] += static_cast<float>(kAlong[p][k]) * odd[p];
    }
#pragma GCC unroll 3
    for (int k = 0; k < 3; ++k) flow[k] += 0.5f * rate.force[k];
    f.of[0][i] += rate.even * (kWeightAtRest * density - f.of[0][i]);
#pragma GCC unroll 9
    for (int p = 0; p < kPairs; ++p) {
      float along = 0, push = 0;
#pragma GCC unroll 3
      for (int k = 0; k < 3; ++k) {
        along += static_cast<float>(kAlong[p][k]) * flow[k];
        push += static_cast<float>(kAlong[p][k]) * rate.force[k];
      }
      const float w3 = 3 * weight(p);
      const float to_even = rate.even * (weight(p) * density - 0.5f * even[p]);
      const float to_odd =
          rate.odd * (w3 * along - 0.5f * odd[p]) + (1 - 0.5f * rate.odd) * w3 * push;
      f.of[2 * p + 1][i] += to_even + to_odd;
      f.of[2 * p + 2][i] += to_even - to_odd;
    }
  }
}

class Flow {
 public:
  // Starts at rest under the pressures `start` of the pores.
  Flow(const PoreSpace& space, double viscosity, int axis, const std::vector<double>& start)
      : space_(space), rate_(relaxation(viscosity, axis)), axis_(axis), count_(space.count()) {
    blocks_ = (count_ + kBlock - 1) / kBlock;
    pitch_ = blocks_ * kBlock;
    slots_.assign(kVelocities * pitch_, 0);
    links_.resize((kVelocities - 1) * pitch_);
    for_each_block([&](std::size_t block) { link(block); });
    link_open_ends();
    for (int q = 0; q < kVelocities; ++q) {
      const float weight_of_q = q == 0 ? kWeightAtRest : weight((q - 1) / 2);
      for (std::size_t i = 0; i < count_; ++i)
        slots_[q * pitch_ + i] = 3 * weight_of_q * static_cast<float>(start[i]);
    }
  }

  void two_steps() {
    for_each_block([&](std::size_t block) { even_step(block * kBlock); });
    turn_at_open_ends();
    for_each_block([&](std::size_t block) { odd_step(block * kBlock); });
    turn_at_open_ends();
  }

  // Sum of the velocity along the axis in each layer across it.
  std::vector<double> layers() const {
    std::vector<double> sums(static_cast<std::size_t>(space_.layers()));
    for (std::size_t i = 0; i < count_; ++i)
      sums[space_.position(static_cast<std::uint32_t>(i))[axis_]] += velocity_of(i);
    return sums;
  }

 private:
  template <class Work>
  void for_each_block(const Work& work) const {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks_, kBlocksPerTask),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                        for (std::size_t block = range.begin(); block < range.end(); ++block)
                          work(block);
                      });
  }

  // Slot in which velocity q leaves a pore in an odd step. At a wall it turns round. Pores that
  // fill up the last block keep to themselves.
  void link(std::size_t block) {
    for (int q = 1; q < kVelocities; ++q)
      for (std::size_t i = block * kBlock; i < (block + 1) * kBlock; ++i) {
        std::size_t slot = opposite(q) * pitch_ + i;
        if (i < count_) {
          const std::uint32_t to = space_.neighbor(static_cast<std::uint32_t>(i), velocity(q));
          if (to != PoreSpace::kSolid) slot = q * pitch_ + to;
        }
        links_[(q - 1) * pitch_ + i] = static_cast<std::uint32_t>(slot);
      }
  }

  // A velocity that leaves through an open end comes back, mirrored, in the layer that it leaves.
  void link_open_ends() {
    if (space_.repeats_along_axis()) return;
    for (std::uint32_t i = 0; i < count_; ++i) {
      const std::int64_t at = space_.position(i)[axis_];
      if (at != 0 && at != space_.layers() - 1) continue;
      for (int q = 1; q < kVelocities; ++q) {
        Offset across = velocity(q);
        if (!space_.passes_open_end(i, across)) continue;
        across[axis_] = 0;
        const std::uint32_t to = space_.neighbor(i, across);
        if (to == PoreSpace::kSolid) continue;
        const std::size_t slot = mirrored(q, axis_) * pitch_ + to;
        links_[(q - 1) * pitch_ + i] = static_cast<std::uint32_t>(slot);
        open_slots_.push_back(slot);
      }
    }
  }

  void turn_at_open_ends() {
    for (const std::size_t slot : open_slots_) slots_[slot] = -slots_[slot];
  }

  void even_step(std::size_t first) {
    Populations f;
    for (int q = 0; q < kVelocities; ++q) std::copy_n(&slots_[q * pitch_ + first], kBlock, f.of[q]);
    collide(f, rate_);
    for (int q = 0; q < kVelocities; ++q)
      std::copy_n(f.of[q], kBlock, &slots_[opposite(q) * pitch_ + first]);
  }

  void odd_step(std::size_t first) {
    Populations f;
    std::copy_n(&slots_[first], kBlock, f.of[0]);
    for (int q = 1; q < kVelocities; ++q) {
      const std::uint32_t* from = links_of(opposite(q)) + first;
      for (int i = 0; i < kBlock; ++i) f.of[q][i] = slots_[from[i]];
    }
    collide(f, rate_);
    std::copy_n(f.of[0], kBlock, &slots_[first]);
    for (int q = 1; q < kVelocities; ++q) {
      const std::uint32_t* to = links_of(q) + first;
      for (int i = 0; i < kBlock; ++i) slots_[to[i]] = f.of[q][i];
    }
  }

  const std::uint32_t* links_of(int q) const { return &links_[(q - 1) * pitch_]; }

  double velocity_of(std::size_t pore) const {
    double sum = 0.5 * rate_.force[axis_];
    for (int p = 0; p < kPairs; ++p)
      sum += kAlong[p][axis_] * (static_cast<double>(slots_[(2 * p + 1) * pitch_ + pore]) -
                                 slots_[(2 * p + 2) * pitch_ + pore]);
    return sum;
  }

  const PoreSpace& space_;
  Relaxation rate_;
  int axis_;
  std::size_t count_, blocks_ = 0, pitch_ = 0;
  std::vector<float> slots_;             // [velocity][pore]
  std::vector<std::uint32_t> links_;     // [velocity - 1][pore]
  std::vector<std::size_t> open_slots_;  // of velocities that leave through an open end
};

// Conductivity of each pore as the square of its distance to the wall.
std::vector<double> conductivities_of(const PoreSpace& space) {
  std::vector<double> conductivities;
  for (const int depth : space.depths()) conductivities.push_back((depth - 0.5) * (depth - 0.5));
  return conductivities;
}

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// Pressures that are near the final ones: those of a flow with the conductivities of the pores.
// From pressures of zero a run takes several times the steps.
std::vector<double> first_pressures(const PoreSpace& space,
                                    const std::vector<double>& conductivities) {
  constexpr double kTolerance = 1e-3;
  TransportResult ignored;
  std::vector<double> pressures =
      Laplace(space, conductivities).solve(kTolerance, 10000, {}, ignored);
  // The potential is the pressure less the work of the force.
  const auto length = static_cast<double>(space.layers());
  for (std::uint32_t i = 0; i < space.count(); ++i)
    pressures[i] = pressures[i] * length + static_cast<double>(space.position(i)[space.axis()]);
  const double zero = space.repeats_along_axis() ? mean_of(pressures) : length - 0.5;
  for (double& pressure : pressures) pressure -= zero;
  return pressures;
}

// The viscosity that comes to rest soonest. The flow in a pore settles at a rate that grows with
// viscosity, the pressure along the volume at one that falls with it and with the square of its
// longest wave, which between open ends is twice the length. The rates of a tube of the same mean
// conductivity are equal, up to critical damping, at half of that conductivity divided by the wave.
double best_viscosity(const PoreSpace& space, const std::vector<double>& conductivities) {
  const double wave = static_cast<double>(space.layers()) * (space.repeats_along_axis() ? 1 : 2);
  return std::min(kMaxViscosity, mean_of(conductivities) / (2 * wave));
}

// Whether the last third of the values differs by at most a tolerance. Pressure swings before it
// comes to rest, so that one small change says little.
bool is_steady(const std::vector<double>& values, double tolerance) {
  if (values.size() < 6) return false;
  const auto begin = static_cast<std::ptrdiff_t>(2 * values.size() / 3);
  const auto [least, most] = std::minmax_element(values.begin() + begin, values.end());
  return *most - *least <= tolerance * std::abs(values.back());
}

// Mean deviation of the values from their mean, relative to it.
double variation(const std::vector<double>& values) {
  const double mean = mean_of(values);
  double sum = 0;
  for (const double value : values) sum += std::abs(value - mean);
  return sum / (static_cast<double>(values.size()) * std::abs(mean));
}

}  // namespace

TransportResult permeability(const VoxelImage& image, const FlowSettings& settings,
                             const Progress& progress) {
  const PoreSpace space(image, settings.axis, settings.boundary);
  TransportResult result;
  result.conducting_voxels = space.count();
  if (space.count() == 0) return result;
  const std::vector<double> conductivities = conductivities_of(space);
  const double viscosity =
      settings.viscosity > 0 ? settings.viscosity : best_viscosity(space, conductivities);
  Flow flow(space, viscosity, settings.axis, first_pressures(space, conductivities));
  std::vector<double> values;
  result.has_converged = false;
  while (!result.has_converged && result.steps < settings.max_steps) {
    for (int step = 0; step < kCheckSteps; step += 2) flow.two_steps();
    result.steps += kCheckSteps;
    const std::vector<double> layers = flow.layers();
    const double total = std::accumulate(layers.begin(), layers.end(), 0.0);
    result.value = viscosity * total / voxels_of(image);
    values.push_back(result.value);
    // As much passes through every layer once the pressure has settled along the whole volume. It
    // may drift for so long that the value seems steady before.
    result.has_converged = is_steady(values, settings.tolerance) &&
                           variation(layers) <= kLayerTolerance * settings.tolerance;
    if (progress && !progress(result.steps, result.value)) break;
  }
  return result;
}

}  // namespace solidtex::transport
