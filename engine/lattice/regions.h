// Which boxes of its inputs an operation needs, and a graph of every node.
#pragma once

#include <span>
#include <vector>

#include "engine/common/box.h"
#include "engine/model/model.h"

namespace solidtex::engine {

// The box of each input that one operation needs for a box of its output: conv3d widens, upsample
// halves with floor.
Box required_input(const Op& op, const Box& output);

// The box every node must be known on so that the output is known on `output`; same order as
// model.nodes. A backward pass; several consumers unite. With tile_origins, one for each node,
// every node goes on along x to the end of a tile of two that begins there, so that an evaluation
// that moves along x computes no tile twice, and coarse ones to the end of every second tile, so
// that they need not be entered at every step.
std::vector<Box> required_regions(const LatticeModel& model, const Box& output,
                                  std::span<const int> tile_origins = {});

}  // namespace solidtex::engine
