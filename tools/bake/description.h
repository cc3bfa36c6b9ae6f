// Texts about a volume, for files that have a place for them.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tools/bake/output.h"

namespace solidtex::tools {

using Fields = std::vector<std::pair<std::string, std::string>>;

// The model, channels, the encoding of colors, and the unit of lengths if there is one.
Fields description_fields(const Output& output, const Volume& volume);

// These, the edges of a voxel, and the center of the first one: "solidtex_voxel_size" and
// "solidtex_position", each three numbers.
Fields placed_fields(const Output& output, const Volume& volume);

// "solidtex_model=granite-grey" and so on, each on a line.
std::string lines_of(const Fields& fields);

}  // namespace solidtex::tools
