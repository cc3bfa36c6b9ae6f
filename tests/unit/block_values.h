// Shared by tests of kernels.
#pragma once

#include <vector>

#include "engine/lattice/block.h"

namespace solidtex::engine {

// Returns the values of a block without the padding of its rows.
inline std::vector<float> values_of(const Block& block) {
  std::vector<float> values;
  const Volume& v = block.volume();
  for (int c = 0; c < v.channels; ++c)
    for (std::int64_t x = 0; x < v.size[0]; ++x)
      for (std::int64_t y = 0; y < v.size[1]; ++y)
        values.insert(values.end(), v.row(c, x, y), v.row(c, x, y) + v.size[2]);
  return values;
}

}  // namespace solidtex::engine
