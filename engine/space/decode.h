// From a code z to a model: the conditioned network, folded into plain weights.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "engine/space/space.h"

namespace solidtex::engine {

// Returns the bytes of a model file with a material of the space. `details` is a JSON object with
// the keys name, license, exemplar and training of the model's document, each optional, or "". The
// same arguments give the same bytes everywhere.
std::vector<std::byte> decode(const Space& space, const Material& material,
                              const std::string& details);

}  // namespace solidtex::engine
