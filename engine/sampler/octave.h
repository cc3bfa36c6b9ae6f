// Cells of the octaves' lattices that contain points: a block of points in one octave, or one point
// in all octaves.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/model/model.h"
#include "engine/noise/reference.h"

namespace solidtex::engine {

inline constexpr int kOctaveBlock = 48;  // points: whole vectors and register tiles on every target

struct PlanarPositions {
  // Splits (x, y, z) triples into planes.
  void assign(const double* positions, int count) {
    for (int p = 0; p < count; ++p)
      for (int a = 0; a < 3; ++a) axis[a][p] = positions[3 * p + a];
  }

  alignas(64) double axis[3][kOctaveBlock];
};

struct OctaveCells {
  alignas(64) std::int32_t corner[3][kOctaveBlock];  // modulo 2^32
  alignas(64) float fraction[3][kOctaveBlock];       // in [0, 1]

  LatticeCells view() const {
    return {{corner[0], corner[1], corner[2]}, {fraction[0], fraction[1], fraction[2]}};
  }
};

// All octaves, planar: entry [i] belongs to octave i. Rounded up to kStep octaves.
struct OctaveBank {
  static constexpr int kStep = 16;  // whole vectors on every target

  OctaveBank(const Tensor& transforms, std::uint64_t seed);

  std::array<double, 9> transform_of(int octave) const;
  StreamKey key_of(int octave) const;
  StreamKeys keys(int first) const;
  std::size_t padded() const { return key[0].size(); }

  int count;
  std::vector<double> transform[9];
  std::vector<std::uint32_t> key[4];
};

// Transforms each position (3 x 3, row-major) in double and splits it into cell and fraction.
void find_octave_cells(const double* transform, const PlanarPositions& positions, int count,
                       OctaveCells& cells);

// Transforms one position by the octaves [first, first + count) of a bank.
void find_point_cells(const OctaveBank& bank, int first, int count, const double position[3],
                      OctaveCells& cells);

namespace reference {
void find_octave_cells(const double* transform, const PlanarPositions& positions, int count,
                       OctaveCells& cells);
void find_point_cells(const OctaveBank& bank, int first, int count, const double position[3],
                      OctaveCells& cells);
}  // namespace reference

}  // namespace solidtex::engine
