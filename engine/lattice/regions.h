// Required regions: the boxes on which the nodes of a graph must be known.
#pragma once

#include <span>
#include <vector>

#include "engine/common/box.h"
#include "engine/model/model.h"

namespace solidtex::engine {

// Returns the box of each input that an operation needs for a box of its output.
Box required_input(const Op& op, const Box& output);

// Returns the box on which every node must be known for a box of the output, in the order of
// model.nodes. A node with several readers needs the union of their boxes.
//
// With tile_origins, one per node, every box is extended along x to the end of a tile, so that an
// evaluation in steps along x computes no tile twice. Boxes of coarse nodes end at every second
// tile, so that not every step computes them.
std::vector<Box> required_regions(const LatticeModel& model, const Box& output,
                                  std::span<const int> tile_origins = {});

}  // namespace solidtex::engine
