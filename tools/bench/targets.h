// Included before Highway in every file with vector code, as in the library: arrays of vectors do
// not go with scalable ones.
#pragma once

#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
