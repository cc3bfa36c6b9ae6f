// Which boxes of its inputs an operation needs, and a graph of every node.
#pragma once

#include <vector>

#include "engine/field/box.h"
#include "engine/model/model.h"

namespace solidtex::engine {

// The box of each input that one operation needs for a box of its output: conv3d widens, upsample
// halves with floor.
Box required_input(const Op& op, const Box& output);

// exact: what the output needs and nothing more. whole_tiles: along x every node goes on to the end
// of a tile, so that an evaluation that moves along x computes no tile twice.
enum class LookAhead { exact, whole_tiles };

// The box every node must be known on so that the output is known on `output`; same order as
// model.nodes. A backward pass; several consumers unite.
std::vector<Box> required_regions(const FieldModel& model, const Box& output,
                                  LookAhead ahead = LookAhead::exact);

}  // namespace solidtex::engine
