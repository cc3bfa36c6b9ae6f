#include "engine/sampler/octave.h"

#include <cmath>

namespace solidtex::engine {

namespace {

// A whole number modulo 2^32. Steps stay exact however large it is; what is not a number gives 0.
std::int32_t wrap(double whole) {
  const double rest = whole - std::floor(whole * 0x1p-32) * 0x1p32;
  return rest >= 0 && rest < 0x1p32 ? static_cast<std::int32_t>(static_cast<std::uint32_t>(rest))
                                    : 0;
}

}  // namespace

void find_octave_cells(const double* transform, const PlanarPositions& positions, int count,
                       OctaveCells& cells) {
  for (int axis = 0; axis < 3; ++axis) {
    const double* row = transform + 3 * axis;
    for (int p = 0; p < count; ++p) {
      const double at =
          std::fma(row[2], positions.axis[2][p],
                   std::fma(row[1], positions.axis[1][p], row[0] * positions.axis[0][p]));
      const double whole = std::floor(at);
      cells.index[axis][p] = wrap(whole);
      cells.fraction[axis][p] = static_cast<float>(at - whole);
    }
  }
}

}  // namespace solidtex::engine
