// The instruction sets of this machine that are worth comparing.
#pragma once

#include <string>
#include <vector>

namespace solidtex::tools {

// Those with a fused multiply-add, the best first, by Highway's names.
std::vector<std::string> fused_targets();

}  // namespace solidtex::tools
