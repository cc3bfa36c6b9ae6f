// How much arithmetic a model needs for one value when every convolution is computed directly.
#pragma once

#include <nlohmann/json.hpp>

namespace solidtex::tools {

// Multiply-adds for one voxel (field; in the limit of a large box) or one point (sampler), from
// the document of a model. Only convolutions and dense layers count.
double direct_multiply_adds(const nlohmann::json& document);

}  // namespace solidtex::tools
