#include "plugins/transport/laplace.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace solidtex::transport {
namespace {

constexpr std::size_t kChunk = 16384;
constexpr int kCheckSteps = 50;

// Runs work(begin, end) on fixed chunks and adds what they return in one order, whatever the
// threads.
template <class Work>
double sum_of_chunks(std::size_t count, const Work& work) {
  std::vector<double> sums((count + kChunk - 1) / kChunk);
  tbb::parallel_for(std::size_t{0}, sums.size(), [&](std::size_t chunk) {
    sums[chunk] = work(chunk * kChunk, std::min(count, (chunk + 1) * kChunk));
  });
  double total = 0;
  for (const double sum : sums) total += sum;
  return total;
}

}  // namespace

Laplace::Laplace(const PoreSpace& space, const Vector& conductivities)
    : space_(space),
      count_(space.count()),
      diagonal_(count_),
      right_side_(count_),
      neighbors_(kFaces.size() * count_),
      conductances_(conductivities.empty() ? 0 : neighbors_.size()) {
  sum_of_chunks(count_, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) set_row(i, conductivities);
    return 0.0;
  });
}

void Laplace::set_row(std::size_t i, const Vector& conductivities) {
  const auto pore = static_cast<std::uint32_t>(i);
  for (std::size_t face = 0; face < kFaces.size(); ++face) {
    const std::uint32_t other = space_.neighbor(pore, kFaces[face]);
    neighbors_[kFaces.size() * i + face] = other;
    const int end = space_.end_passed(pore, kFaces[face]);
    if (other == PoreSpace::kSolid) {
      if (!space_.passes_open_end(pore, kFaces[face])) continue;
      const double conductance = conductivities.empty() ? 2 : 2 * conductivities[i];
      diagonal_[i] += conductance;
      if (end < 0) right_side_[i] += conductance;
      continue;
    }
    double conductance = 1;
    if (!conductivities.empty()) {
      const double a = conductivities[i], b = conductivities[other];
      conductance = 2 * a * b / (a + b);
      conductances_[kFaces.size() * i + face] = static_cast<float>(conductance);
    }
    diagonal_[i] += conductance;
    right_side_[i] -= end * conductance;  // the copy before is higher by 1, the one after lower
  }
}

// product = A x. Returns x A x.
double Laplace::multiply(const Vector& x, Vector& product) const {
  return sum_of_chunks(count_, [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i) {
      double row = diagonal_[i] * x[i];
      for (std::size_t link = kFaces.size() * i; link < kFaces.size() * (i + 1); ++link) {
        const std::uint32_t other = neighbors_[link];
        if (other == PoreSpace::kSolid) continue;
        row -= conductances_.empty() ? x[other] : conductances_[link] * x[other];
      }
      product[i] = row;
      sum += x[i] * row;
    }
    return sum;
  });
}

Laplace::Vector Laplace::solve(double tolerance, std::int64_t max_steps, const Progress& progress,
                               TransportResult& result) const {
  Vector x(count_), residual = right_side_, direction(count_), product(count_);
  // Runs the sum of residual^2 / diagonal, after an update of each entry.
  const auto size_after = [&](const auto& update) {
    return sum_of_chunks(count_, [&](std::size_t begin, std::size_t end) {
      double sum = 0;
      for (std::size_t i = begin; i < end; ++i) {
        update(i);
        sum += residual[i] * residual[i] / diagonal_[i];
      }
      return sum;
    });
  };
  double size = size_after([](std::size_t) {}), last = 1;
  const double first = size, limit = tolerance * tolerance * first;
  result.steps = 0;
  while (size > limit && result.steps < max_steps) {
    const double scale = result.steps == 0 ? 0 : size / last;
    sum_of_chunks(count_, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        direction[i] = residual[i] / diagonal_[i] + scale * direction[i];
      return 0.0;
    });
    const double step = size / multiply(direction, product);
    last = size;
    size = size_after([&](std::size_t i) {
      x[i] += step * direction[i];
      residual[i] -= step * product[i];
    });
    if (++result.steps % kCheckSteps == 0 && progress && !progress(result.steps, size / first))
      break;
  }
  result.has_converged = size <= limit;
  return x;
}

double Laplace::total_flux(const Vector& potential) const {
  return sum_of_chunks(count_, [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const auto pore = static_cast<std::uint32_t>(i);
      for (const int step : {-1, 1}) {
        const std::size_t face = 2 * static_cast<std::size_t>(space_.axis()) + (step > 0 ? 1 : 0);
        const std::size_t link = kFaces.size() * i + face;
        const std::uint32_t other = neighbors_[link];
        const int passed = space_.end_passed(pore, kFaces[face]);
        if (other != PoreSpace::kSolid && step > 0) {
          const double conductance = conductances_.empty() ? 1 : conductances_[link];
          sum += conductance * (potential[i] - potential[other] + passed);
        } else if (space_.passes_open_end(pore, kFaces[face])) {
          // Half a voxel at twice the conductance.
          sum += passed < 0 ? 1 - potential[i] : potential[i];
        }
      }
    }
    return sum;
  });
}

}  // namespace solidtex::transport
