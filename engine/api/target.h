// The instruction set that the kernels run on, and the environment's say in it.
#pragma once

namespace solidtex::engine {

// Keeps the kernels off all instruction sets better than the one that SOLIDTEX_TARGET names, if it
// is set. The first call reads it; throws where it names none that this machine has.
void limit_target();

// As Highway calls it: "AVX2".
const char* target_name();

}  // namespace solidtex::engine
