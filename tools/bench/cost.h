// Arithmetic cost of a model with direct convolution.
#pragma once

#include <nlohmann/json.hpp>

namespace solidtex::tools {

// Returns the multiply-adds of convolutions and dense layers for one voxel (lattice; in the limit
// of a large box) or one point (sampler), from the document of a model.
double direct_multiply_adds(const nlohmann::json& document);

}  // namespace solidtex::tools
