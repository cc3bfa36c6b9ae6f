// Evaluates a volume in pieces; memory is bounded by one piece.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "tools/bake/volume.h"
#include "tools/common/progress.h"

namespace solidtex::tools {

struct Piece {
  Index3 offset, size;            // relative to the volume's origin
  std::span<const float> values;  // [x][y][z][channel]
};

inline constexpr std::int64_t max_piece_bytes = 64 << 20;

// The size of the largest piece: up to max_piece_bytes, at most `depth` voxels along z, and long
// along x, where the lattice family evaluates plane after plane.
Index3 choose_piece(const Volume& volume, std::int64_t depth);

// Evaluates voxels from `offset` on, relative to the volume's origin, into [x][y][z][channel].
// Throws if a value is not finite.
void evaluate(const Volume& volume, const Index3& offset, const Index3& size,
              std::vector<float>& values);

// Throws the engine's error if voxels of the volume lie beyond its range.
void check_range(const Volume& volume);

// Calls `take` for each piece; pieces with the same z come one after another. The volume is cut at
// multiples of `largest`, along x also in between, to react to Ctrl-C within a second. The library
// evaluates each piece in parallel. A piece is left out where `is_wanted`(offset, size) is false.
// Throws Interrupted after Ctrl-C.
using IsWanted = std::function<bool(const Index3& offset, const Index3& size)>;
void for_each_piece(const Volume& volume, const Index3& largest, Progress& progress,
                    const std::function<void(const Piece&)>& take, const IsWanted& is_wanted = {});

}  // namespace solidtex::tools
