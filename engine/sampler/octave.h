// Where a block of points falls on an octave's lattice.
#pragma once

#include <cstdint>

namespace solidtex::engine {

inline constexpr int kOctaveBlock = 96;  // points: whole vectors and register tiles on every target

struct PlanarPositions {
  alignas(64) double axis[3][kOctaveBlock];
};

struct OctaveCells {
  alignas(64) std::int32_t corner[3][kOctaveBlock];  // modulo 2^32
  alignas(64) float fraction[3][kOctaveBlock];       // in [0, 1]
};

// transform (3 x 3, row-major) times each position, all in double, split into cell and fraction.
void find_octave_cells(const double* transform, const PlanarPositions& positions, int count,
                       OctaveCells& cells);

namespace reference {
void find_octave_cells(const double* transform, const PlanarPositions& positions, int count,
                       OctaveCells& cells);
}

}  // namespace solidtex::engine
