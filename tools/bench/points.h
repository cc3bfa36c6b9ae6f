// Cases that evaluate points, for both families.
#pragma once

#include "tools/bench/cases.h"

namespace solidtex::tools {

using Points = std::vector<float>;
using FillPoints = std::function<void(Points&)>;

// Fills points uniformly in a cube: few points share a cell of the finer octaves, or a brick.
void scatter(Points& points);

// Fills a square of a plane oblique to all axes, one texel apart, as a camera samples it.
void lay_on_plane(Points& points);

constexpr float cube_texels = 256;  // edge of the cube to scatter in

struct PointQuery {
  FillPoints fill;
  int count = 0, per_call = 0;
  bool with_gradients = false;
  bool again = false;  // the same points in every repetition, evaluated once before
};

// A square batch of points, one call.
PointQuery batch_of(const CaseSettings& settings, FillPoints fill);

Case point_case(const solidtex::texture& texture, const PointQuery& query);

}  // namespace solidtex::tools
