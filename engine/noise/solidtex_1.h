// Scheme solidtex-1 on the active target, with the bits of reference.h.
#pragma once

#include "engine/noise/reference.h"

namespace solidtex::engine::solidtex_1 {

void plane(const StreamKey& key, Distribution distribution, const LatticePoints& points, int count,
           float* values);
void trilinear_normal(const StreamKey& key, const LatticeCells& cells, int count, float* values);
void trilinear_normal_derivatives(const StreamKey& key, const LatticeCells& cells,
                                  const float* transform, int count, float* values,
                                  float* const* derivatives);
void trilinear_normal_of_streams(const StreamKeys& keys, const LatticeCells& cells, int count,
                                 float* values);

}  // namespace solidtex::engine::solidtex_1
