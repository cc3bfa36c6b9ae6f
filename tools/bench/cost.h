// The arithmetic of a model with direct convolution.
#pragma once

#include <nlohmann/json.hpp>

namespace solidtex::tools {

// Multiply-adds for one voxel (lattice; in the limit of a large box) or one point (sampler), from
// the document of a model. Counts convolutions and dense layers.
double direct_multiply_adds(const nlohmann::json& document);

}  // namespace solidtex::tools
